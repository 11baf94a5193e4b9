#include "core/query/support_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__x86_64__)
#define HULLD_HAS_AVX2_PATH
#endif

namespace hulld {
namespace {

// Up to this many vertices a scan beats a climb. Observed: tests/bench/query_benchmark.
constexpr size_t kMostScanned = 48;
// Cells of the cube map per vertex. Observed: more of them save less than their cache misses cost.
constexpr double kCellsPerVertex = 3;
// A plateau larger than this is not flooded; every vertex is looked at instead.
constexpr size_t kMostFlooded = 64;

bool HasAvx2() {
#ifdef HULLD_HAS_AVX2_PATH
  static const bool has = __builtin_cpu_supports("avx2");
  return has;
#else
  return false;
#endif
}

// Four doubles, and four integers as wide, in whatever registers the function is compiled for.
using Lanes = double __attribute__((vector_size(32)));
using LaneIds = int64_t __attribute__((vector_size(32)));

[[gnu::always_inline]] inline void Load(const double* from, Lanes& lanes) {
  std::memcpy(&lanes, from, sizeof lanes);
}

[[gnu::always_inline]] inline void Broadcast(double value, Lanes& lanes) {
  lanes = Lanes{value, value, value, value};
}

// The values along (x, y, z) of four vertices.
template <typename Block>
[[gnu::always_inline]] inline void Evaluate(const Block& block, const Lanes& x, const Lanes& y,
                                            const Lanes& z, Lanes& values) {
  Lanes px, py, pz;
  Load(block.x, px);
  Load(block.y, py);
  Load(block.z, pz);
  values = (x * px + y * py) + z * pz;
}

// The lane with the largest value, of these the one with the lowest id.
[[gnu::always_inline]] inline int LargestLane(const Lanes& values, const LaneIds& ids) {
  int best = 0;
  for (int i = 1; i < 4; ++i) {
    if (values[i] > values[best] || (values[i] == values[best] && ids[i] < ids[best])) best = i;
  }
  return best;
}

template <typename Block, typename Support>
[[gnu::always_inline]] inline void ScanBlocks(const std::vector<Block>& blocks, size_t count,
                                              const Vector& n, Support& support) {
  Lanes x, y, z, best, values;
  Broadcast(n.x(), x);
  Broadcast(n.y(), y);
  Broadcast(n.z(), z);
  Evaluate(blocks[0], x, y, z, best);
  LaneIds best_ids = {0, 1, 2, 3};
  LaneIds ids = best_ids;
  const LaneIds four = {4, 4, 4, 4};
  for (size_t i = 1; i < blocks.size(); ++i) {
    ids += four;
    Evaluate(blocks[i], x, y, z, values);
    const LaneIds better = values > best;
    best = better ? values : best;
    best_ids = better ? ids : best_ids;
  }
  const int lane = LargestLane(best, best_ids);
  support.vertex =
      static_cast<uint32_t>(std::min<int64_t>(best_ids[lane], static_cast<int64_t>(count) - 1));
  support.value = best[lane];
  support.certain = true;
}

template <typename NeighborBlock, typename Support>
[[gnu::always_inline]] inline void ClimbBlocks(const NeighborBlock* neighbors,
                                               const uint32_t* starts, const Vector& n, double blur,
                                               Support& support) {
  Lanes x, y, z, values;
  Broadcast(n.x(), x);
  Broadcast(n.y(), y);
  Broadcast(n.z(), z);
  for (;;) {
    const NeighborBlock* block = neighbors + starts[support.vertex];
    const NeighborBlock* const end = neighbors + starts[support.vertex + 1];
    Lanes best;
    Evaluate(block->positions, x, y, z, best);
    LaneIds best_ids = {block->ids[0], block->ids[1], block->ids[2], block->ids[3]};
    for (++block; block != end; ++block) {
      Evaluate(block->positions, x, y, z, values);
      const LaneIds ids = {block->ids[0], block->ids[1], block->ids[2], block->ids[3]};
      const LaneIds better = values > best;
      best = better ? values : best;
      best_ids = better ? ids : best_ids;
    }
    const int lane = LargestLane(best, best_ids);
    if (!(best[lane] > support.value)) {
      support.certain = best[lane] < support.value - blur;
      return;
    }
    support.vertex = static_cast<uint32_t>(best_ids[lane]);
    support.value = best[lane];
  }
}

}  // namespace

SupportMap::SupportMap(const Hull& hull) : vertices_(hull.vertices()) {
  // Below dimension 3 a polygon's or a segment's edges lead to the farthest vertex too.
  if (vertices_.size() <= kMostScanned) {
    for (size_t i = 0; i < vertices_.size(); i += 4) {
      Fill(blocks_.emplace_back(), vertices_.subspan(i));
    }
    return;
  }
  BuildNeighbors(hull);
  BuildStarts();
}

void SupportMap::Fill(Block& block, std::span<const Vector> positions) {
  for (size_t lane = 0; lane < 4; ++lane) {
    const Vector& position = positions[std::min(lane, positions.size() - 1)];
    block.x[lane] = position.x();
    block.y[lane] = position.y();
    block.z[lane] = position.z();
  }
}

void SupportMap::BuildNeighbors(const Hull& hull) {
  const size_t count = vertices_.size();
  std::vector<uint32_t> degrees(count);
  for (const Edge& edge : hull.edges()) {
    ++degrees[edge.tail];
    ++degrees[edge.head];
  }
  neighbor_starts_.resize(count + 1);
  for (size_t i = 0; i < count; ++i) {
    neighbor_starts_[i + 1] = neighbor_starts_[i] + (degrees[i] + 3) / 4;
  }
  neighbors_.resize(neighbor_starts_[count]);
  std::vector<uint32_t> filled(count);
  const auto add = [&](uint32_t vertex, uint32_t neighbor) {
    const uint32_t place = filled[vertex]++;
    // The lanes from this one on: repeated until another neighbour takes them.
    NeighborBlock& block = neighbors_[neighbor_starts_[vertex] + place / 4];
    const Vector& position = vertices_[neighbor];
    for (uint32_t lane = place % 4; lane < 4; ++lane) {
      block.positions.x[lane] = position.x();
      block.positions.y[lane] = position.y();
      block.positions.z[lane] = position.z();
      block.ids[lane] = neighbor;
    }
  };
  for (const Edge& edge : hull.edges()) {
    add(edge.tail, edge.head);
    add(edge.head, edge.tail);
  }
}

void SupportMap::BuildStarts() {
  const double cells = kCellsPerVertex * static_cast<double>(vertices_.size());
  side_ = std::max(2u, static_cast<uint32_t>(std::sqrt(cells / 6)));
  starts_.resize(size_t{6} * side_ * side_);
  size_t cell = 0;
  uint32_t last = 0;
  for (int face = 0; face < 6; ++face) {
    for (uint32_t i = 0; i < side_; ++i) {
      for (uint32_t j = 0; j < side_; ++j, ++cell) {
        Vector n;
        n[face / 2] = face % 2 == 0 ? 1 : -1;
        n[(face / 2 + 1) % 3] = (2 * i + 1.0) / side_ - 1;
        n[(face / 2 + 2) % 3] = (2 * j + 1.0) / side_ - 1;
        last = Climb(last, n, 0).vertex;
        starts_[cell] = last;
      }
    }
  }
}

uint32_t SupportMap::StartOf(const Vector& n) const {
  const double x = std::abs(n.x());
  const double y = std::abs(n.y());
  const double z = std::abs(n.z());
  const int axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  const double largest = axis == 0 ? x : axis == 1 ? y : z;
  // Also for n = 0 and for infinite quotients: some cell.
  const double scale = 0.5 * side_ / largest;
  const auto index = [&](double component) {
    const double place = component * scale + 0.5 * side_;
    return place > 0 ? std::min(static_cast<uint32_t>(std::min(place, 65536.0)), side_ - 1) : 0u;
  };
  const uint32_t face = 2 * axis + (n[axis] < 0 ? 1 : 0);
  const uint32_t i = index(n[(axis + 1) % 3]);
  const uint32_t j = index(n[(axis + 2) % 3]);
  return starts_[(face * side_ + i) * side_ + j];
}

double SupportMap::ValueOf(uint32_t vertex, const Vector& n) const {
  const Vector& v = vertices_[vertex];
  return (n.x() * v.x() + n.y() * v.y()) + n.z() * v.z();
}

SupportMap::Support SupportMap::ScanPortably(const Vector& n) const {
  Support support;
  ScanBlocks(blocks_, vertices_.size(), n, support);
  return support;
}

SupportMap::Support SupportMap::ClimbPortably(uint32_t start, const Vector& n, double blur) const {
  Support support{start, ValueOf(start, n), false};
  ClimbBlocks(neighbors_.data(), neighbor_starts_.data(), n, blur, support);
  return support;
}

#ifdef HULLD_HAS_AVX2_PATH
__attribute__((target("avx2"))) SupportMap::Support SupportMap::ScanAvx2(const Vector& n) const {
  Support support;
  ScanBlocks(blocks_, vertices_.size(), n, support);
  return support;
}

__attribute__((target("avx2"))) SupportMap::Support SupportMap::ClimbAvx2(uint32_t start,
                                                                          const Vector& n,
                                                                          double blur) const {
  Support support{start, ValueOf(start, n), false};
  ClimbBlocks(neighbors_.data(), neighbor_starts_.data(), n, blur, support);
  return support;
}
#else
SupportMap::Support SupportMap::ScanAvx2(const Vector& n) const { return ScanPortably(n); }
SupportMap::Support SupportMap::ClimbAvx2(uint32_t start, const Vector& n, double blur) const {
  return ClimbPortably(start, n, blur);
}
#endif

SupportMap::Support SupportMap::Scan(const Vector& n) const {
  return HasAvx2() ? ScanAvx2(n) : ScanPortably(n);
}

SupportMap::Support SupportMap::Climb(uint32_t start, const Vector& n, double blur) const {
  return HasAvx2() ? ClimbAvx2(start, n, blur) : ClimbPortably(start, n, blur);
}

SupportMap::Support SupportMap::Farthest(const Vector& n, double blur) const {
  if (!blocks_.empty()) return Scan(n);
  return Climb(StartOf(n), n, blur);
}

// Calls visit(vertex, value) for all vertices with a value of at least from.value - slack, or says
// false when there are too many. Such vertices are connected by edges among themselves.
template <typename Visit>
bool SupportMap::VisitPlateau(const Support& from, const Vector& n, double slack,
                              Visit visit) const {
  const double least = from.value - slack;
  std::array<uint32_t, kMostFlooded> found;
  size_t count = 1;
  found[0] = from.vertex;
  visit(from.vertex, from.value);
  for (size_t next = 0; next < count; ++next) {
    const uint32_t vertex = found[next];
    for (uint32_t b = neighbor_starts_[vertex]; b < neighbor_starts_[vertex + 1]; ++b) {
      for (const uint32_t id : neighbors_[b].ids) {
        const double value = ValueOf(id, n);
        if (!(value >= least)) continue;
        if (std::find(found.begin(), found.begin() + count, id) != found.begin() + count) continue;
        if (count == kMostFlooded) return false;
        found[count++] = id;
        visit(id, value);
      }
    }
  }
  return true;
}

SupportMap::Support SupportMap::CertainFarthest(const Vector& n, double blur) const {
  Support support = Farthest(n, blur);
  if (support.certain) return support;
  Support best = support;
  const auto consider = [&](uint32_t vertex, double value) {
    if (value > best.value || (value == best.value && vertex < best.vertex)) {
      best = {vertex, value, true};
    }
  };
  if (!VisitPlateau(support, n, blur, consider)) {
    for (uint32_t i = 0; i < vertices_.size(); ++i) consider(i, ValueOf(i, n));
  }
  best.certain = true;
  return best;
}

std::vector<uint32_t> SupportMap::Plateau(const Vector& n, double slack) const {
  const Support top = CertainFarthest(n, slack);
  const double least = top.value - slack;
  std::vector<uint32_t> plateau;
  const auto add = [&](uint32_t vertex, double value) {
    if (value >= least) plateau.push_back(vertex);
  };
  if (!blocks_.empty() || !VisitPlateau(top, n, slack, add)) {
    plateau.clear();
    for (uint32_t i = 0; i < vertices_.size(); ++i) add(i, ValueOf(i, n));
  }
  std::sort(plateau.begin(), plateau.end());
  return plateau;
}

size_t SupportMap::MemoryBytes() const {
  return blocks_.capacity() * sizeof(Block) + neighbors_.capacity() * sizeof(NeighborBlock) +
         neighbor_starts_.capacity() * sizeof(uint32_t) + starts_.capacity() * sizeof(uint32_t);
}

}  // namespace hulld
