"""Client of hulld, a server of 3D convex hulls and exact collision queries.

    import hulld

    with hulld.local() as client:                       # or hulld.Client("HOST:PORT")
        client.append_points("box", points, create=True)  # n x 3
        answer = client.check_collision("box", ("box", pose), separation=True)
        print(answer.relation.name, answer.separation)

README.md of the package shows each task.
"""

import importlib
from typing import TYPE_CHECKING, Any

from hulld._version import __version__

if TYPE_CHECKING:
    from hulld.aio import (
        AsyncAppender,
        AsyncClient,
        AsyncCollisionStream,
        AsyncCollisionWatch,
        AsyncHullWatch,
    )
    from hulld.answers.bodies import Body, BodyInfo, ReplacedBody
    from hulld.answers.collisions import (
        Analysis,
        AnswerRow,
        Answers,
        Axis,
        AxisKind,
        Batch,
        Certificate,
        Collision,
        CollisionChanges,
        CollisionEvent,
        CollisionEventKind,
        DecidingPiece,
        Feature,
        FirstContact,
        HullSize,
        HullVersion,
        Method,
        Normal,
        PieceCertificate,
        Problem,
        Relation,
        Rung,
        Scene,
        SceneTotals,
        SeparatedInterval,
        Separation,
        StreamAnswer,
        VertexPair,
        Witness,
    )
    from hulld.answers.containment import Containment
    from hulld.answers.hits import Hits
    from hulld.answers.hulls import (
        Audit,
        BoundedValue,
        CreatedHull,
        Durability,
        Header,
        Hull,
        HullChanges,
        HullEvent,
        HullEventKind,
        HullInfo,
        HullMesh,
        HullProperties,
        PointCounts,
        ReplacedHull,
    )
    from hulld.answers.status import Limits, ServerStatus
    from hulld.appender import Appender
    from hulld.calls.append_state import Appended, Opened
    from hulld.calls.freshness import Freshness
    from hulld.client import Client
    from hulld.collision_stream import CollisionStream
    from hulld.connection import DEFAULT_SERVER, Tls, read_token_file
    from hulld.errors import (
        AbortedError,
        AlreadyExistsError,
        CancelledError,
        DataLossError,
        DeadlineExceededError,
        FailedPreconditionError,
        HulldError,
        InternalError,
        InvalidArgumentError,
        NotFoundError,
        PermissionDeniedError,
        ResourceExhaustedError,
        UnauthenticatedError,
        UnavailableError,
        UnimplementedError,
    )
    from hulld.geometry.placements import (
        Placement,
        PlacementLike,
        Placements,
        PlacementsLike,
        all_pairs,
    )
    from hulld.geometry.points import PointsLike, as_points
    from hulld.geometry.poses import ORTHOGONALITY_TOLERANCE, Pose, PoseLike, PosesLike, pack_poses
    from hulld.judging import Fault, Judged, WrongAnswer, judge
    from hulld.local_server import Local, LocalServer, check, local
    from hulld.programs import find_program
    from hulld.retry import RetryPolicy
    from hulld.robot.answers import RobotCheck
    from hulld.robot.robot import Robot
    from hulld.verification import VerificationError, Verifier
    from hulld.watches import CollisionWatch, HullWatch

__all__ = [
    "DEFAULT_SERVER",
    "ORTHOGONALITY_TOLERANCE",
    "AbortedError",
    "AlreadyExistsError",
    "Analysis",
    "AnswerRow",
    "Answers",
    "Appended",
    "Appender",
    "AsyncAppender",
    "AsyncClient",
    "AsyncCollisionStream",
    "AsyncCollisionWatch",
    "AsyncHullWatch",
    "Audit",
    "Axis",
    "AxisKind",
    "Batch",
    "Body",
    "BodyInfo",
    "BoundedValue",
    "CancelledError",
    "Certificate",
    "Client",
    "Collision",
    "CollisionChanges",
    "CollisionEvent",
    "CollisionEventKind",
    "CollisionStream",
    "CollisionWatch",
    "Containment",
    "CreatedHull",
    "DataLossError",
    "DeadlineExceededError",
    "DecidingPiece",
    "Durability",
    "FailedPreconditionError",
    "Fault",
    "Feature",
    "FirstContact",
    "Freshness",
    "Header",
    "Hits",
    "Hull",
    "HullChanges",
    "HullEvent",
    "HullEventKind",
    "HullInfo",
    "HullMesh",
    "HullProperties",
    "HullSize",
    "HullVersion",
    "HullWatch",
    "HulldError",
    "InternalError",
    "InvalidArgumentError",
    "Judged",
    "Limits",
    "Local",
    "LocalServer",
    "Method",
    "Normal",
    "NotFoundError",
    "Opened",
    "PermissionDeniedError",
    "PieceCertificate",
    "Placement",
    "PlacementLike",
    "Placements",
    "PlacementsLike",
    "PointCounts",
    "PointsLike",
    "Pose",
    "PoseLike",
    "PosesLike",
    "Problem",
    "Relation",
    "ReplacedBody",
    "ReplacedHull",
    "ResourceExhaustedError",
    "RetryPolicy",
    "Robot",
    "RobotCheck",
    "Rung",
    "Scene",
    "SceneTotals",
    "SeparatedInterval",
    "Separation",
    "ServerStatus",
    "StreamAnswer",
    "Tls",
    "UnauthenticatedError",
    "UnavailableError",
    "UnimplementedError",
    "VerificationError",
    "Verifier",
    "VertexPair",
    "Witness",
    "WrongAnswer",
    "__version__",
    "all_pairs",
    "as_points",
    "check",
    "find_program",
    "judge",
    "local",
    "pack_poses",
    "read_token_file",
]

#: The modules that define the names of __all__.
_MODULES = (
    "answers.bodies",
    "answers.collisions",
    "answers.containment",
    "answers.hits",
    "answers.hulls",
    "answers.status",
    "appender",
    "calls.append_state",
    "calls.freshness",
    "client",
    "collision_stream",
    "connection",
    "errors",
    "geometry.placements",
    "geometry.points",
    "geometry.poses",
    "judging",
    "local_server",
    "programs",
    "retry",
    "robot.answers",
    "robot.robot",
    "verification",
    "watches",
    "aio",
)


def __getattr__(name: str) -> Any:
    # Names are imported at first use: `import hulld` alone loads neither numpy nor gRPC.
    if name in __all__:
        for module in _MODULES:
            found = getattr(importlib.import_module(f"hulld.{module}"), name, None)
            if found is not None:
                globals()[name] = found
                return found
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
