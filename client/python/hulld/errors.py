"""Errors of calls: one class per gRPC status, with the reason and metadata of the server."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, TypeVar

from google.protobuf.message import DecodeError

from hulld.rpc import error_details_pb2

D = TypeVar("D")
T = TypeVar("T")

_DETAILS = "grpc-status-details-bin"
_REQUEST_ID = "x-request-id"
_RETRY = "grpc-retry-pushback-ms"
_ERROR_INFO = "google.rpc.ErrorInfo"


class HulldError(Exception):
    """A failed call. Programs should use the class, or `code`, `reason`, and `metadata`; the text
    is for people and may change.

    code: gRPC's status, as in "NOT_FOUND". message: the problem and its remedy. reason: the name
    in proto/hulld/v1/error.proto, as in "HULL_NOT_FOUND"; None for errors of gRPC itself. metadata:
    details of the reason, as in {"hull_id": "arm"}. request_id: of the call in the server's log, or
    None. retry_after: the seconds to wait before a retry, or None if the server does not suggest
    one.
    """

    code = "UNKNOWN"

    def __init__(
        self,
        message: str,
        *,
        code: str | None = None,
        reason: str | None = None,
        metadata: Mapping[str, str] | None = None,
        request_id: str | None = None,
        retry_after: float | None = None,
    ) -> None:
        super().__init__(message)
        if code is not None:
            self.code = code
        self.message = message
        self.reason = reason
        self._metadata = dict(metadata or {})
        self.request_id = request_id
        self.retry_after = retry_after

    @property
    def metadata(self) -> Mapping[str, str]:
        return MappingProxyType(self._metadata)

    def __str__(self) -> str:
        details = [self.reason] if self.reason else []
        if self.request_id:
            details.append(f"request {self.request_id}")
        return f"{self.code}: {self.message}" + (f" ({', '.join(details)})" if details else "")


class CancelledError(HulldError):
    """The client ended the call."""

    code = "CANCELLED"


class InvalidArgumentError(HulldError, ValueError):
    """The request is wrong; the message names the field."""

    code = "INVALID_ARGUMENT"


class DeadlineExceededError(HulldError):
    """No answer arrived in time."""

    code = "DEADLINE_EXCEEDED"


class NotFoundError(HulldError, LookupError):
    """The hull does not exist."""

    code = "NOT_FOUND"


class AlreadyExistsError(HulldError):
    """The hull already exists."""

    code = "ALREADY_EXISTS"


class PermissionDeniedError(HulldError):
    """The token's role or prefix does not allow it."""

    code = "PERMISSION_DENIED"


class ResourceExhaustedError(HulldError):
    """A limit is exceeded; metadata["flag"] names it. Temporary if retry_after is set."""

    code = "RESOURCE_EXHAUSTED"


class FailedPreconditionError(HulldError):
    """The hull was deleted or replaced while a stream was open, a chunk is missing, the store is in
    memory and cannot be saved, the client is closed, or the process was forked with an open
    client."""

    code = "FAILED_PRECONDITION"


class AbortedError(HulldError):
    """The hull is not at the revision required by the request; metadata["current_revision"] is its
    revision."""

    code = "ABORTED"


class UnimplementedError(HulldError):
    """The server does not implement the call."""

    code = "UNIMPLEMENTED"


class InternalError(HulldError):
    """The server failed, or sent a malformed answer."""

    code = "INTERNAL"


class UnavailableError(HulldError):
    """The server cannot be reached, is draining, or cannot write its store."""

    code = "UNAVAILABLE"


class DataLossError(HulldError):
    """The stored hull is damaged."""

    code = "DATA_LOSS"


class UnauthenticatedError(HulldError):
    """The call has no token, or an unknown one."""

    code = "UNAUTHENTICATED"


_CLASSES = {kind.code: kind for kind in HulldError.__subclasses__()}


def status_name(code: int) -> str:
    """The name of a status code."""
    import grpc

    return next((status.name for status in grpc.StatusCode if status.value[0] == code), "UNKNOWN")


def error_class(code: str) -> type[HulldError]:
    """The class for a status, as in "NOT_FOUND"."""
    return _CLASSES.get(code, HulldError)


def read_answer(read: Callable[[D], T], data: D) -> T:
    """Reads data from the server. InternalError: the data is malformed or inconsistent."""
    try:
        return read(data)
    except HulldError:
        raise
    except (ValueError, DecodeError) as error:
        raise InternalError(f"the server's answer cannot be read: {error}") from error


def from_status(code: str, message: str, trailing: Iterable[tuple[str, Any]] | None) -> HulldError:
    """The error of a call with this status and these trailing metadata."""
    metadata = {key: value for key, value in trailing or ()}
    reason, info = _error_info(metadata.get(_DETAILS))
    request_id = metadata.get(_REQUEST_ID)
    return error_class(code)(
        message,
        code=code,
        reason=reason,
        metadata=info,
        request_id=None if request_id is None else str(request_id),
        retry_after=_retry_after(metadata.get(_RETRY)),
    )


def from_rpc_error(error: Any) -> HulldError:
    """Converts gRPC's exception, of its synchronous or its asynchronous interface."""
    code, details = error.code().name, error.details() or ""
    # gRPC also reports CANCELLED when a call reaches a server during its shutdown.
    if code == "CANCELLED" and not details.startswith(("Locally cancelled", "Channel closed")):
        code, details = "UNAVAILABLE", "the server ended the call because it is shutting down"
    return from_status(code, details, error.trailing_metadata())


def _error_info(details: Any) -> tuple[str | None, dict[str, str]]:
    if not isinstance(details, bytes):
        return None, {}
    status = error_details_pb2.Status()
    info = error_details_pb2.ErrorInfo()
    try:
        status.ParseFromString(details)
        for detail in status.details:
            if detail.type_url.endswith("/" + _ERROR_INFO):
                info.ParseFromString(detail.value)
    except DecodeError:
        # Keeps the status if the details are malformed.
        return None, {}
    if info.domain != "hulld":
        return None, {}
    return info.reason, dict(info.metadata)


def _retry_after(hint: Any) -> float | None:
    try:
        milliseconds = int(hint)
    except (TypeError, ValueError):
        return None
    # A negative number forbids retries.
    return milliseconds / 1000 if milliseconds >= 0 else None
