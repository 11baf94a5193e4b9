"""The search for the first contact of each pair while a robot moves from waypoint to waypoint; the
method of `hullctl robot check --continuous`.

A span of time between two waypoints is checked as a motion of the server between the poses at its
ends. Each shape is inflated by the bound of its deviation from that motion, so "separated" is
proven for the path itself. Where the inflated shapes meet, the span is halved, and the poses in its
middle are checked exactly. A contact is claimed only for such poses. The earliest span that is
still open when no point of either shape travels farther than half of the resolution ends the search
between these waypoints.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from hulld.answers.collisions import Batch, Relation
from hulld.geometry.placements import Placements
from hulld.robot.answers import MotionContact
from hulld.robot.description import NO_MOTION
from hulld.robot.motion_bounds import MAX_TURN, MotionBound

# The limits of client/hullctl/robot/continuous_check.cc.
_MAX_SEARCHES = 4096
_MAX_SPANS = 4096
_SPANS_PER_SEARCH = 8
_MAX_TURN_OF_SEGMENT = 4096
_SHORTEST_SPAN = 2.0**-50
_ROUNDED_UP = 1 + 2.0**-50

_Floats = npt.NDArray[np.float64]
_Indices = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Movers:
    """The parts of a robot that moves through waypoints, and the placements around it. names: of
    the parts, then of the placements. ids: of the parts. radii, reaches: of the parts; a reach is
    the largest distance of a point from the origin of its frame. bounds: parts x segments.
    poses_at(segments, times): m x parts x 7, between the waypoints at both ends of segments."""

    names: Sequence[str]
    ids: Sequence[str]
    radii: _Floats
    reaches: _Floats
    bounds: MotionBound
    around: Placements
    poses_at: Callable[[_Indices, _Floats], _Floats]

    def refuse_far_motions(self) -> None:
        """ValueError: a part turns or moves too far between two waypoints."""
        reach = self.reaches[:, np.newaxis]
        good = self.bounds.turn <= _MAX_TURN_OF_SEGMENT
        good = good & np.isfinite(self.bounds.deviation(1.0, reach))
        if good.all():
            return
        part, segment = np.argwhere(~good)[0]
        raise ValueError(
            f"{self.names[part]} turns or moves too far between waypoints {segment} and "
            f"{segment + 1}; add waypoints between them"
        )

    def place(
        self, objects: _Indices, radii: _Floats, poses: _Floats, ends: _Floats | None
    ) -> tuple[Placements, npt.NDArray[np.uint32]]:
        """Placements of pairs, and their indices. objects: k x 2, radii: k x 2; poses, ends: of all
        parts, k x parts x 7."""
        parts = len(self.ids)
        placements = copy.copy(self.around)
        placements.ids = [*self.ids, *self.around.ids]
        hulls = np.concatenate([np.arange(parts), self.around.indices + parts])
        placements.indices = hulls[objects].astype(np.uint32).reshape(-1)
        placements.radii = radii.reshape(-1)
        moves = objects < parts
        part = np.where(moves, objects, 0)
        # The last row represents the parts.
        around = np.concatenate([self.around.poses, [NO_MOTION]])
        fixed = around[np.where(moves, -1, objects - parts)]
        rows = np.arange(len(objects))[:, np.newaxis]

        def of_objects(of_parts: _Floats) -> _Floats:
            chosen = np.where(moves[:, :, np.newaxis], of_parts[rows, part], fixed)
            return chosen.reshape(-1, 7)

        placements.poses = of_objects(poses)
        placements.end_poses = None if ends is None else of_objects(ends)
        return placements, np.arange(2 * len(objects), dtype=np.uint32).reshape(-1, 2)


@dataclass(frozen=True)
class _Span:
    begin: float
    duration: float
    #: True if the span is too short to halve.
    is_last: bool = False


@dataclass
class _Search:
    """The search for the first contact of a pair between two waypoints. open: the spans before the
    contact that are not proven free, in order of time."""

    segment: int
    pair: int
    open: list[_Span] = field(default_factory=lambda: [_Span(0.0, 1.0)])
    contact_time: float | None = None
    relation: Relation | None = None
    is_done: bool = False

    def close(self) -> None:
        end = 1.0 if self.contact_time is None else self.contact_time
        self.open = [span for span in self.open if span.begin < end]
        self.is_done = not self.open or self.open[0].is_last


class MotionSearch:
    """ask(placements, pairs, objects, **options): returns the answers of Client.check_collisions;
    raises if a pair has none. objects: k x 2, indices of parts, then of the surrounding placements;
    pairs: m x 2, likewise. clearance: separations up to this count as contact. resolution: see
    Robot.check_motion."""

    def __init__(
        self,
        movers: Movers,
        pairs: npt.NDArray[np.uint32],
        ask: Callable[..., Batch],
        clearance: float,
        resolution: float,
    ) -> None:
        self._movers = movers
        self._pairs = pairs.astype(np.intp)
        self._ask = ask
        self._clearance = clearance
        self._resolution = resolution

    def contacts(self, segments: int) -> Iterator[MotionContact]:
        """Yields the ends of all searches that do not prove a pair free, ordered by waypoint."""
        closed: set[int] = set()
        at_once = max(1, _MAX_SEARCHES // len(self._pairs))
        for first in range(0, segments, at_once):
            searches = [
                _Search(segment, pair)
                for segment in range(first, min(segments, first + at_once))
                for pair in range(len(self._pairs))
                if pair not in closed
            ]
            while not all(search.is_done for search in searches):
                self._round(searches)
            for search in searches:
                if search.pair in closed or (search.contact_time is None and not search.open):
                    continue
                if search.contact_time is not None:
                    closed.add(search.pair)
                a, b = self._pairs[search.pair]
                until = search.open[0].begin if search.open else search.contact_time
                yield MotionContact(
                    search.segment,
                    (self._movers.names[a], self._movers.names[b]),
                    search.relation,
                    until or 0.0,
                    search.contact_time,
                )

    def _round(self, searches: Sequence[_Search]) -> None:
        """Queries the first open spans of each search, then the poses in their middle."""
        met: dict[int, int] = {}
        for search in searches:
            if search.contact_time is not None:
                met.setdefault(search.pair, search.segment)
        asked: list[tuple[_Search, _Span]] = []
        for search in searches:
            # A contact makes the later searches of its pair unnecessary.
            if search.segment > met.get(search.pair, search.segment):
                search.is_done = True
            if not search.is_done and len(asked) < _MAX_SPANS:
                asked += [(search, span) for span in search.open[:_SPANS_PER_SEARCH]]
        segments = np.array([search.segment for search, _ in asked], np.intp)
        objects = self._pairs[[search.pair for search, _ in asked]]
        begins = np.array([span.begin for _, span in asked])
        durations = np.array([span.duration for _, span in asked])
        moves, bounds, reaches = self._moving(segments, objects)
        span = durations[:, np.newaxis]
        can_ask = (~moves | (span * bounds.turn <= MAX_TURN)).all(axis=1)
        travel = np.where(moves, bounds.travel(span, reaches), 0).sum(axis=1)
        is_last = can_ask & ((travel <= self._resolution / 2) | (durations <= _SHORTEST_SPAN))
        until = np.zeros(len(asked))
        until[can_ask] = self._separated_until(
            segments[can_ask], objects[can_ask], begins[can_ask], durations[can_ask]
        )
        times = self._divide(asked, until.tolist(), is_last.tolist())
        self._check_poses(times)
        for search, _ in asked:
            search.close()

    def _moving(
        self, segments: _Indices, objects: _Indices
    ) -> tuple[npt.NDArray[np.bool_], MotionBound, _Floats]:
        """True for parts, and the bounds and reaches of these; m x 2."""
        moves = objects < len(self._movers.ids)
        part = np.where(moves, objects, 0)
        bounds = self._movers.bounds.at(part, segments[:, np.newaxis])
        return moves, bounds, self._movers.reaches[part]

    def _radii(self, objects: _Indices) -> _Floats:
        around = self._movers.around
        fixed = np.zeros(len(around)) if around.radii is None else around.radii
        radii: _Floats = np.concatenate([self._movers.radii, fixed])[objects]
        return radii

    def _separated_until(
        self, segments: _Indices, objects: _Indices, begins: _Floats, durations: _Floats
    ) -> _Floats:
        """The fraction of each span up to which its pair is proven free; 1: throughout."""
        if not len(segments):
            return np.empty(0)
        moves, bounds, reaches = self._moving(segments, objects)
        inflation = np.where(moves, bounds.deviation(durations[:, np.newaxis], reaches), 0.0)
        inflation[:, 0] += self._clearance
        radii = self._radii(objects)
        radii = np.where(inflation == 0, radii, _ROUNDED_UP * (radii + inflation))
        ends = [
            _normalized(self._movers.poses_at(segments, times))
            for times in (begins, begins + durations)
        ]
        placements, pairs = self._movers.place(objects, radii, *ends)
        # Only the halves of a span matter.
        answers = self._ask(
            placements, pairs, objects, max_time_error=0.25, resolution=self._resolution / 2
        ).answers
        is_free = answers.relations == Relation.SEPARATED
        until = np.zeros(len(segments)) if answers.separated_until is None else (
            answers.separated_until
        )
        return np.where(is_free, 1.0, np.minimum(until, 0.75))

    def _divide(
        self, asked: Sequence[tuple[_Search, _Span]], until: list[float], is_last: list[bool]
    ) -> list[tuple[_Search, float]]:
        """Replaces the queried spans, at the front of their searches, with their halves that are
        not proven free. Returns the times at which poses have to be checked."""
        times: list[tuple[_Search, float]] = []
        left: dict[int, list[_Span]] = {}
        for (search, span), proven, last in zip(asked, until, is_last):
            spans = left.setdefault(id(search), [])
            if proven == 1:
                continue
            if span.duration == 1:
                times += [(search, 0.0), (search, 1.0)]
            if last:
                spans.append(_Span(span.begin, span.duration, True))
                continue
            half = span.duration / 2
            times.append((search, span.begin + half))
            if proven <= 0.5:
                spans.append(_Span(span.begin, half))
            spans.append(_Span(span.begin + half, half))
        for search, _ in asked:
            if id(search) in left:
                search.open = left.pop(id(search)) + search.open[_SPANS_PER_SEARCH:]
        return times

    def _check_poses(self, times: Sequence[tuple[_Search, float]]) -> None:
        if not times:
            return
        segments = np.array([search.segment for search, _ in times], np.intp)
        objects = self._pairs[[search.pair for search, _ in times]]
        poses = self._movers.poses_at(segments, np.array([time for _, time in times]))
        placements, pairs = self._movers.place(objects, self._radii(objects), poses, None)
        clearance = self._clearance if self._clearance > 0 else None
        answers = self._ask(placements, pairs, objects, clearance=clearance).answers
        relations = answers.relations
        meets = (relations == Relation.TOUCHING) | (relations == Relation.OVERLAPPING)
        if answers.within_clearance is not None:
            meets = meets | answers.within_clearance
        for row in np.flatnonzero(meets).tolist():
            search, time = times[row]
            if search.contact_time is None or time <= search.contact_time:
                search.contact_time = time
                search.relation = Relation(int(relations[row]))


def _normalized(poses: _Floats) -> _Floats:
    poses[..., :4] /= np.sqrt((poses[..., :4] ** 2).sum(axis=-1, keepdims=True))
    return poses
