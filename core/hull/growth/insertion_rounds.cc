#include "core/hull/growth/insertion_rounds.h"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

#include "core/base/check.h"

namespace hulld {
namespace {

// Approximate number of points of the first round.
constexpr size_t kFirstRound = 64;

// Parameters of the map of directions for a round (see Surface::MeasureBefore).
constexpr double kRoundMapFineness = 2.8;
constexpr double kRoundWalksPerPoint = 0.2;

// Odd and far from any power of two, so that consecutive numbers get distant ranks.
constexpr uint32_t kMultiplier = 0x9E3779B1u;

// Returns the inverse of an odd number modulo 2^32, by Newton's iteration: each step doubles the
// number of correct bits.
constexpr uint32_t InverseOf(uint32_t odd) {
  uint32_t x = odd;
  for (int i = 0; i < 5; ++i) x *= 2 - odd * x;
  return x;
}
static_assert(InverseOf(kMultiplier) * kMultiplier == 1);

uint32_t Scramble(uint32_t x) {
  x ^= x >> 16;
  x *= 0x7FEB352Du;
  x ^= x >> 15;
  x *= 0x846CA68Bu;
  return x ^ (x >> 16);
}

// Sort key of a point: the place of its direction in the upper half, the point's index in the
// lower.
using SortKey = uint64_t;
// Cells per side, as a power of two, of the grid of places; and the bits of a place: three for the
// face of the cube. As fine as the upper half can hold: points along a curve, such as the rim of a
// prism, are in few cells.
constexpr int kGridBits = 14;
constexpr int kPlaceBits = 3 + 2 * kGridBits;
static_assert(kPlaceBits <= 32);

// The result is unsorted if the poll stops.
void SortByUpperHalf(std::vector<SortKey>& keys, std::vector<SortKey>& scratch, StopPoll& poll) {
  constexpr size_t kWorthRadix = 2048;
  if (keys.size() < kWorthRadix) {
    std::sort(keys.begin(), keys.end());
    return;
  }
  constexpr int kDigit = 11;
  constexpr size_t kKeysPerStep = 256;
  scratch.resize(keys.size());
  for (int shift = 32; shift < 32 + kPlaceBits; shift += kDigit) {
    if (poll.Step(keys.size() / kKeysPerStep)) return;
    std::array<uint32_t, 1 << kDigit> starts{};
    constexpr uint64_t kMask = (1 << kDigit) - 1;
    for (const SortKey key : keys) ++starts[(key >> shift) & kMask];
    uint32_t sum = 0;
    for (uint32_t& start : starts) {
      const uint32_t count = start;
      start = sum;
      sum += count;
    }
    for (const SortKey key : keys) scratch[starts[(key >> shift) & kMask]++] = key;
    keys.swap(scratch);
  }
}

// Returns the bits of a number below 2^16, each followed by a zero.
uint32_t Spread(uint32_t x) {
  x = (x | (x << 8)) & 0x00FF00FF;
  x = (x | (x << 4)) & 0x0F0F0F0F;
  x = (x | (x << 2)) & 0x33333333;
  return (x | (x << 1)) & 0x55555555;
}

// Orders directions in Morton order on a fine grid, face by face.
SortKey KeyOf(const DirectionMap& directions, const Vector& point, uint32_t index) {
  const auto cell =
      static_cast<uint32_t>(DirectionMap::PlaceIn(directions.frame(), 1 << kGridBits, point).cell);
  constexpr uint32_t kMask = (1u << kGridBits) - 1;
  const uint32_t face = cell >> (2 * kGridBits);
  const uint32_t order = Spread((cell >> kGridBits) & kMask) << 1 | Spread(cell & kMask);
  return static_cast<uint64_t>(face << (2 * kGridBits) | order) << 32 | index;
}

// One call of InsertInRounds.
class RoundsInsertion {
 public:
  RoundsInsertion(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                  StopPoll& poll)
      : surface_(surface),
        vertices_(vertices),
        points_(points),
        poll_(poll),
        rounds_(points.size()) {}

  bool Run() {
    for (int round = 0; round < rounds_.count(); ++round) {
      Choose(round);
      if (!InsertChosen()) return false;
    }
    return true;
  }

 private:
  // Fills chosen_ with the round's points that cannot be rejected at once, in order of insertion.
  void Choose(int round) {
    const bool is_last = round + 1 == rounds_.count();
    members_.clear();
    if (!is_last) rounds_.AppendRound(round, members_);
    // If most points of a round are outside, so are most of the next, even if the surface is new.
    if (surface_.IsMapWorthwhile()) {
      surface_.MeasureBefore(vertices_, is_last ? points_.size() : members_.size(),
                             kRoundMapFineness, kRoundWalksPerPoint, poll_, nullptr);
    }
    const DirectionMap* directions = surface_.directions();
    if (is_last) ChooseLast(round, directions);
    chosen_.clear();
    if (directions == nullptr) {
      for (const uint32_t i : members_) chosen_.push_back(points_[i]);
      return;
    }
    keys_.clear();
    for (const uint32_t i : members_) {
      if (poll_.Step()) return;
      if (!directions->IsCertainlyInside(directions->PlaceOf(points_[i]))) {
        keys_.push_back(KeyOf(*directions, points_[i], i));
      }
    }
    if (!is_last) surface_.CountRejected(members_.size(), members_.size() - keys_.size());
    SortByUpperHalf(keys_, scratch_, poll_);
    // Gathered first: the cache misses of a loop that does nothing else overlap.
    chosen_.reserve(keys_.size());
    for (const SortKey key : keys_) {
      if (poll_.Step()) return;
      chosen_.push_back(points_[static_cast<uint32_t>(key)]);
    }
  }

  // The last round contains most of the points. Reads all points in order, and tests only the
  // survivors for membership.
  void ChooseLast(int round, const DirectionMap* directions) {
    if (directions == nullptr) {
      members_.resize(points_.size());
      std::iota(members_.begin(), members_.end(), 0u);
    } else {
      directions->AppendSurvivors(points_, members_, poll_);
    }
    std::erase_if(members_, [&](uint32_t i) {
      poll_.Step();
      return rounds_.RoundOf(i) != round;
    });
  }

  bool InsertChosen() {
    for (const Vector& point : chosen_) {
      if (poll_.Step(1 + surface_.TakeSteps())) return false;
      surface_.Insert(vertices_, point);
    }
    return !poll_.stopped();
  }

  Surface& surface_;
  VertexTable& vertices_;
  std::span<const Vector> points_;
  StopPoll& poll_;
  InsertionRounds rounds_;
  std::vector<uint32_t> members_;
  std::vector<SortKey> keys_;
  std::vector<SortKey> scratch_;
  std::vector<Vector> chosen_;
};

}  // namespace

InsertionRounds::InsertionRounds(size_t n) : n_(static_cast<uint32_t>(n)), count_(1) {
  HULLD_CHECK(n <= UINT32_MAX);
  while ((kFirstRound << (2 * (count_ - 1))) < n && count_ < 16) ++count_;
  group_mask_ = (1u << (2 * (count_ - 1))) - 1;
}

int InsertionRounds::RoundOf(uint32_t i) const {
  const uint32_t rank = (i * kMultiplier + Scramble(i & ~group_mask_)) & group_mask_;
  return (std::bit_width(rank) + 1) / 2;
}

void InsertionRounds::AppendRound(int round, std::vector<uint32_t>& members) const {
  HULLD_CHECK(round >= 0 && round + 1 < count_);
  for (uint64_t group = 0; group < n_; group += uint64_t{group_mask_} + 1) {
    const auto first = static_cast<uint32_t>(group);
    const uint32_t shift = Scramble(first);
    for (uint32_t rank = FirstRank(round); rank < FirstRank(round + 1); ++rank) {
      const uint32_t low = (rank - shift) * InverseOf(kMultiplier);
      const uint32_t i = first | (low & group_mask_);
      if (i < n_) members.push_back(i);
    }
  }
}

bool InsertInRounds(Surface& surface, VertexTable& vertices, std::span<const Vector> points,
                    StopPoll& poll) {
  return RoundsInsertion(surface, vertices, points, poll).Run();
}

}  // namespace hulld
