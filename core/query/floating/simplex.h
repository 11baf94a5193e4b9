#ifndef HULLD_CORE_QUERY_FLOATING_SIMPLEX_H_
#define HULLD_CORE_QUERY_FLOATING_SIMPLEX_H_

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "core/base/check.h"
#include "core/query/floating/lane_vector.h"
#include "core/query/floating/nearest_part.h"
#include "core/query/placed/plain_vector.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

// Up to three vertices of A - B, called corners: a vertex, an edge, or a triangle, the part of a
// simplex that is nearest to the origin; or four that surround it. The newest corner comes last.
//
// Add() forms a simplex from these corners and a new one, p, and reduces it to its part nearest to
// the origin. That part contains p, because p is farther toward the origin than the other corners,
// so it is one of seven: p, three edges, or three faces. All seven are tested together, in the
// lanes of vector registers and without branches, because the outcome is unpredictable.
class Simplex {
 public:
  uint32_t count() const { return count_; }
  PlainVector corner(uint32_t i) const {
    const uint32_t lane = LaneOf(i);
    return {x_[lane], y_[lane], z_[lane]};
  }
  VertexPair pair(uint32_t i) const { return std::bit_cast<VertexPair>(pairs_[LaneOf(i)]); }
  // Requires: 0 < count() < 4.
  [[gnu::always_inline]] bool Contains(VertexPair pair) const {
    const auto number = std::bit_cast<int64_t>(pair);
    return static_cast<int>(pairs_[0] == number) | static_cast<int>(pairs_[1] == number) |
           static_cast<int>(pairs_[2] == number);
  }

  // Replaces all corners by one.
  [[gnu::always_inline]] void Set(const LaneVector& p, VertexPair pair) { Keep(kAlone, p, pair); }

  // Adds a corner and reduces to the part nearest to the origin, up to rounding. Sets n to a
  // direction from that part toward the origin. Returns false, and keeps the tetrahedron, if it
  // contains the origin. Requires: 0 < count() < 4.
  [[gnu::always_inline]] bool Add(const LaneVector& p, VertexPair pair, LaneVector& n) {
    HULLD_DCHECK(count_ > 0 && count_ < 4);
    if (count_ == 1) {
      AddToVertex(p, pair, n);
      return true;
    }
    const Lanes zero = {0, 0, 0, 0};
    // Lane i: the edges e, f, and g from p to the corners of lanes i, i + 1, and i + 2.
    Lanes ex, ey, ez, fx, fy, fz, gx, gy, gz;
    Load(x_, ex);
    Load(y_, ey);
    Load(z_, ez);
    Next(ex, fx);
    Next(ey, fy);
    Next(ez, fz);
    Next(fx, gx);
    Next(fy, gy);
    Next(fz, gz);
    ex -= p.x, ey -= p.y, ez -= p.z;
    fx -= p.x, fy -= p.y, fz -= p.z;
    gx -= p.x, gy -= p.y, gz -= p.z;
    const Lanes nx = ey * fz - ez * fy, ny = ez * fx - ex * fz, nz = ex * fy - ey * fx;
    const Lanes np = (nx * p.x + ny * p.y) + nz * p.z;
    const Lanes volume = (nx * gx + ny * gy) + nz * gz;
    const Lanes ep = (ex * p.x + ey * p.y) + ez * p.z;
    const Lanes fp = (fx * p.x + fy * p.y) + fz * p.z;
    const Lanes gp = (gx * p.x + gy * p.y) + gz * p.z;
    const Lanes ee = (ex * ex + ey * ey) + ez * ez;
    const Lanes ff = (fx * fx + fy * fy) + fz * fz;
    const Lanes ef = (ex * fx + ey * fy) + ez * fz;
    const Lanes eg = (ex * gx + ey * gy) + ez * gz;
    // The origin is beyond a face if the opposite corner is on the other side.
    const LaneIds beyond = volume > zero ? np > zero : np < zero;
    const LaneIds ahead = ep < zero;
    // The origin projects into a face; into an edge, seen from both of its faces; or p is nearest.
    // In exact arithmetic one mask of one lane is set.
    const LaneIds over_face = (ef * ep > ee * fp) & (ef * fp > ff * ep) & (beyond | kFlat[count_]);
    const LaneIds over_edge = ahead & ~(ef * ep > ee * fp) & ~(eg * ep > ee * gp);
    Lanes any_ahead = reinterpret_cast<Lanes>(ahead);
    Unite(any_ahead);
    const LaneIds alone = ~reinterpret_cast<LaneIds>(any_ahead);
    // Bit i for part i; bit 7 if the origin is outside.
    Lanes bits = reinterpret_cast<Lanes>(
        (over_face & LaneIds{1, 2, 4, 0}) | (over_edge & LaneIds{8, 16, 32, 0}) |
        (alone & LaneIds{64, 64, 64, 64}) | (beyond & LaneIds{128, 128, 128, 0}));
    Unite(bits);
    const auto answers = static_cast<uint32_t>(reinterpret_cast<LaneIds>(bits)[0]);
    if (count_ == 3 && answers < 128) [[unlikely]] {
      SetLane(3, p.plain(), std::bit_cast<int64_t>(pair));
      part_ = kWhole;
      count_ = 4;
      return false;
    }
    const LaneIds sign = {kSign, kSign, kSign, kSign};
    // The direction is selected by masks, because an index would take longer to arrive.
    const LaneIds turn = ~reinterpret_cast<LaneIds>(np) & sign;
    const auto direction = [&](const Lanes& normal, const Lanes& edge, const Lanes& corner,
                               Lanes& toward) __attribute__((always_inline)) {
      const Lanes across = ep * edge - ee * corner;
      toward = reinterpret_cast<Lanes>(((reinterpret_cast<LaneIds>(normal) ^ turn) & over_face) |
                                       (reinterpret_cast<LaneIds>(across) & over_edge) |
                                       ((reinterpret_cast<LaneIds>(corner) ^ sign) & alone));
      Unite(toward);
    };
    direction(nx, ex, p.x, n.x);
    direction(ny, ey, p.y, n.y);
    direction(nz, ez, p.z, n.z);
    const uint32_t one = answers & 127;
    if (!std::has_single_bit(one)) [[unlikely]] {
      n = LaneVector(KeepNearest(p.plain(), pair));
      return true;
    }
    Keep(static_cast<uint32_t>(std::countr_zero(one)), p, pair);
    return true;
  }

  // Reduces a tetrahedron that contains the origin to the nearest of its faces, up to rounding.
  // Returns the outward normal of that face. Requires: count() is 4. Not inlined, to keep the
  // search short.
  [[gnu::noinline]] PlainVector ReduceToNearestFace() {
    double nearest = INFINITY;
    uint32_t off_face = 3;
    PlainVector outwards(1, 0, 0);
    for (uint32_t i = 0; i < 4; ++i) {
      const PlainVector p = corner((i + 1) % 4);
      const PlainVector q = corner((i + 2) % 4);
      const PlainVector r = corner((i + 3) % 4);
      // Faces of a flat tetrahedron have the same plane, so the distance of the plane is not
      // enough.
      const double squared = SquaredNorm(NearestOnTriangle(p, q, r).point);
      if (!(squared < nearest)) continue;
      nearest = squared;
      off_face = i;
      outwards = Cross(q - p, r - p);
      if (Dot(outwards, corner(i) - p) > 0) outwards = -outwards;
    }
    // The newest is in lane 3.
    if (off_face < 3) SetLane(off_face, corner(3), pairs_[3]);
    const double none = std::numeric_limits<double>::quiet_NaN();
    part_ = off_face < 3 ? (off_face + 1) % 3 : 0;
    SetLane(3, {none, none, none}, kNone);
    count_ = 3;
    return outwards;
  }

  // Returns a point of the simplex near to the origin; after Add, the nearest up to rounding. For
  // any rounding, weights are in [0, 1] and the point is in the simplex, up to the rounding of the
  // weighted sum. Requires: 0 < count() < 4.
  PlainVector NearPoint() const {
    const PlainVector p = corner(count_ - 1);
    if (count_ == 1) return p;
    const PlainVector q = corner(count_ - 2);
    if (count_ == 2) return p + Weight(-Dot(q - p, p), SquaredNorm(q - p)) * (q - p);
    const PlainVector r = corner(count_ - 3);
    const PlainVector normal = Cross(q - p, r - p);
    // The origin's coordinates in the triangle, by areas.
    const double area = SquaredNorm(normal);
    const double along_q = Weight(-Dot(Cross(r - p, normal), p), area);
    const double along_r = Weight(-Dot(Cross(normal, q - p), p), area);
    const double sum = std::max(1.0, along_q + along_r);
    return p + (along_q / sum) * (q - p) + (along_r / sum) * (r - p);
  }

 private:
  // Parts with p: 0 to 2 are the faces, with the corners of lanes i and i + 1; 3 to 5 are the
  // edges, with that of lane i - 3; 6 is p alone, 7 the tetrahedron.
  static constexpr uint32_t kFirstEdge = 3;
  static constexpr uint32_t kAlone = 6;
  static constexpr uint32_t kWhole = 7;
  static constexpr uint32_t kCount[7] = {3, 3, 3, 2, 2, 2, 1};
  // The lanes of the corners, p last.
  static constexpr uint8_t kLanes[8][4] = {{0, 1, 2, 2}, {1, 2, 0, 0}, {2, 0, 1, 1}, {0, 1, 1, 1},
                                           {1, 0, 0, 0}, {2, 0, 0, 0}, {0, 0, 0, 0}, {0, 1, 2, 3}};
  // Set in the lanes that keep their corners and in unused lanes.
  static constexpr LaneIds kKept[7] = {{-1, -1, 0, 0}, {0, -1, -1, 0}, {-1, 0, -1, 0},
                                       {-1, 0, 0, 0},  {0, -1, 0, 0},  {0, 0, -1, 0},
                                       {0, 0, 0, 0}};
  static constexpr LaneIds kFree[7] = {{0, 0, 0, -1},  {0, 0, 0, -1},  {0, 0, 0, -1},
                                       {0, 0, -1, -1}, {0, 0, -1, -1}, {0, -1, 0, -1},
                                       {0, -1, -1, -1}};
  // By count(): set if there is no opposite corner.
  static constexpr LaneIds kFlat[4] = {
      {-1, -1, -1, -1}, {-1, -1, -1, -1}, {-1, -1, -1, -1}, {0, 0, 0, 0}};
  static constexpr int64_t kNone = -1;
  static constexpr int64_t kSign = std::numeric_limits<int64_t>::min();

  static double Weight(double part, double whole) {
    return whole > 0 ? std::clamp(part / whole, 0.0, 1.0) : 0;
  }
  // Moves the first three lanes cyclically: lane i becomes that of i + 1.
  [[gnu::always_inline]] static void Next(const Lanes& lanes, Lanes& next) {
    next = __builtin_shufflevector(lanes, lanes, 1, 2, 0, 3);
  }
  // Adds p as Add() does if rounding hides the nearest part, as in flat tetrahedra: compares all
  // parts by their distances. Returns the direction. Not inlined, to keep the search short.
  [[gnu::noinline]] PlainVector KeepNearest(const PlainVector& p, VertexPair pair) {
    NearestPart nearest = NearestOfVertex(p);
    uint32_t kept = kAlone;
    for (uint32_t i = 0; i < 3; ++i) {
      const uint32_t next = (i + 1) % 3;
      if (pairs_[i] == kNone) continue;
      const PlainVector q = {x_[i], y_[i], z_[i]};
      const bool is_face = pairs_[next] != kNone;
      const PlainVector r = is_face ? PlainVector(x_[next], y_[next], z_[next]) : q;
      const NearestPart part = is_face ? NearestOnTriangle(p, q, r) : NearestOnEdge(p, q, 0, 1);
      if (!(SquaredNorm(part.point) < SquaredNorm(nearest.point))) continue;
      nearest = part;
      // A part without p is as near as before; its face with p contains it.
      const bool is_edge = part.count == 2 && part.corners[0] == 0;
      kept = !is_face || (is_edge && part.corners[1] == 1) ? 3 + i : is_edge ? 3 + next : i;
    }
    Keep(kept, LaneVector(p), pair);
    return nearest.toward;
  }
  // Adds p as the rest of Add() would, with the same result. Requires: count() is 1.
  [[gnu::always_inline]] void AddToVertex(const LaneVector& p, VertexPair pair, LaneVector& n) {
    const Lanes ex = Lanes{x_[0], x_[0], x_[0], x_[0]} - p.x;
    const Lanes ey = Lanes{y_[0], y_[0], y_[0], y_[0]} - p.y;
    const Lanes ez = Lanes{z_[0], z_[0], z_[0], z_[0]} - p.z;
    const Lanes ep = (ex * p.x + ey * p.y) + ez * p.z;
    if (ep[0] < 0) [[likely]] {
      const Lanes ee = (ex * ex + ey * ey) + ez * ez;
      n.x = ep * ex - ee * p.x;
      n.y = ep * ey - ee * p.y;
      n.z = ep * ez - ee * p.z;
      Keep(kFirstEdge, p, pair);
    } else {
      n.x = -p.x;
      n.y = -p.y;
      n.z = -p.z;
      Keep(kAlone, p, pair);
    }
  }
  // Keeps the corners of a part, with p.
  [[gnu::always_inline]] void Keep(uint32_t part, const LaneVector& p, VertexPair pair) {
    const LaneIds kept = kKept[part];
    const LaneIds free = kFree[part];
    const auto replace = [&](const LaneIds& by, void* in) __attribute__((always_inline)) {
      LaneIds lanes;
      std::memcpy(&lanes, in, sizeof lanes);
      const LaneIds none = {0, 0, 0, 0};
      lanes = kept < none ? lanes : (by | free);
      std::memcpy(in, &lanes, sizeof lanes);
    };
    const auto number = std::bit_cast<int64_t>(pair);
    replace(reinterpret_cast<LaneIds>(p.x), x_);
    replace(reinterpret_cast<LaneIds>(p.y), y_);
    replace(reinterpret_cast<LaneIds>(p.z), z_);
    replace(LaneIds{number, number, number, number}, pairs_);
    part_ = part;
    count_ = kCount[part];
  }
  uint32_t LaneOf(uint32_t i) const {
    HULLD_DCHECK(i < count_);
    return kLanes[part_][i];
  }
  void SetLane(uint32_t lane, const PlainVector& p, int64_t pair) {
    x_[lane] = p.x;
    y_[lane] = p.y;
    z_[lane] = p.z;
    pairs_[lane] = pair;
  }

  // The corners. Lanes that are not in use have all bits set: their coordinates are NaN, and every
  // comparison with them fails.
  alignas(32) double x_[4];
  alignas(32) double y_[4];
  alignas(32) double z_[4];
  alignas(32) int64_t pairs_[4];
  // The part that the last reduction kept.
  uint32_t part_ = kAlone;
  uint32_t count_ = 0;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_FLOATING_SIMPLEX_H_
