"""The public names of the package and the modules that define them."""

from hulld._version import __version__ as __version__
from hulld.aio import (
    AsyncAppender as AsyncAppender,
    AsyncClient as AsyncClient,
    AsyncCollisionStream as AsyncCollisionStream,
    AsyncCollisionWatch as AsyncCollisionWatch,
    AsyncHullWatch as AsyncHullWatch,
)
from hulld.answers.bodies import Body as Body, BodyInfo as BodyInfo, ReplacedBody as ReplacedBody
from hulld.answers.collisions import (
    Analysis as Analysis,
    AnswerRow as AnswerRow,
    Answers as Answers,
    Axis as Axis,
    AxisKind as AxisKind,
    Batch as Batch,
    Certificate as Certificate,
    Collision as Collision,
    CollisionChanges as CollisionChanges,
    CollisionEvent as CollisionEvent,
    CollisionEventKind as CollisionEventKind,
    DecidingPiece as DecidingPiece,
    Feature as Feature,
    FirstContact as FirstContact,
    HullSize as HullSize,
    HullVersion as HullVersion,
    Method as Method,
    Normal as Normal,
    PieceCertificate as PieceCertificate,
    Problem as Problem,
    Relation as Relation,
    Rung as Rung,
    Scene as Scene,
    SceneTotals as SceneTotals,
    SeparatedInterval as SeparatedInterval,
    Separation as Separation,
    StreamAnswer as StreamAnswer,
    VertexPair as VertexPair,
    Witness as Witness,
)
from hulld.answers.containment import Containment as Containment
from hulld.answers.hits import Hits as Hits
from hulld.answers.hulls import (
    Audit as Audit,
    BoundedValue as BoundedValue,
    CreatedHull as CreatedHull,
    Durability as Durability,
    Header as Header,
    Hull as Hull,
    HullChanges as HullChanges,
    HullEvent as HullEvent,
    HullEventKind as HullEventKind,
    HullInfo as HullInfo,
    HullMesh as HullMesh,
    HullProperties as HullProperties,
    PointCounts as PointCounts,
    ReplacedHull as ReplacedHull,
)
from hulld.answers.status import Limits as Limits, ServerStatus as ServerStatus
from hulld.appender import Appender as Appender
from hulld.calls.append_state import Appended as Appended, Opened as Opened
from hulld.calls.freshness import Freshness as Freshness
from hulld.client import Client as Client
from hulld.collision_stream import CollisionStream as CollisionStream
from hulld.connection import (
    DEFAULT_SERVER as DEFAULT_SERVER,
    Tls as Tls,
    read_token_file as read_token_file,
)
from hulld.errors import (
    AbortedError as AbortedError,
    AlreadyExistsError as AlreadyExistsError,
    CancelledError as CancelledError,
    DataLossError as DataLossError,
    DeadlineExceededError as DeadlineExceededError,
    FailedPreconditionError as FailedPreconditionError,
    HulldError as HulldError,
    InternalError as InternalError,
    InvalidArgumentError as InvalidArgumentError,
    NotFoundError as NotFoundError,
    PermissionDeniedError as PermissionDeniedError,
    ResourceExhaustedError as ResourceExhaustedError,
    UnauthenticatedError as UnauthenticatedError,
    UnavailableError as UnavailableError,
    UnimplementedError as UnimplementedError,
)
from hulld.geometry.placements import (
    Placement as Placement,
    PlacementLike as PlacementLike,
    Placements as Placements,
    PlacementsLike as PlacementsLike,
    all_pairs as all_pairs,
)
from hulld.geometry.points import PointsLike as PointsLike, as_points as as_points
from hulld.geometry.poses import (
    ORTHOGONALITY_TOLERANCE as ORTHOGONALITY_TOLERANCE,
    Pose as Pose,
    PoseLike as PoseLike,
    PosesLike as PosesLike,
    pack_poses as pack_poses,
)
from hulld.judging import (
    Fault as Fault,
    Judged as Judged,
    WrongAnswer as WrongAnswer,
    judge as judge,
)
from hulld.local_server import (
    Local as Local,
    LocalServer as LocalServer,
    check as check,
    local as local,
)
from hulld.programs import find_program as find_program
from hulld.retry import RetryPolicy as RetryPolicy
from hulld.robot.answers import RobotCheck as RobotCheck
from hulld.robot.robot import Robot as Robot
from hulld.verification import VerificationError as VerificationError, Verifier as Verifier
from hulld.watches import CollisionWatch as CollisionWatch, HullWatch as HullWatch
