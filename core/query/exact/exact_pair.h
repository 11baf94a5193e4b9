#ifndef HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/base/scan_poll.h"
#include "core/hull/hull.h"
#include "core/numeric/integer.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/minkowski_vertex.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

using ExactCorner = MinkowskiVertex<IntegerVector>;

// A pair of placed hulls in integers, exactly.
//
// With Q the quaternions' integers and N = |Q|^2, the world coordinates, shifted by -t_A and
// multiplied by N_A N_B and a power of two, are integers: N_B R(Q_A) P_A for A, and N_A R(Q_B) P_B
// + N_A N_B (T_B - T_A) for B; or multiplied by N_A alone if N_A = N_B. They have degree 5 in the
// input; about 280 bits at a common exponent. For a piece of a body, the pose is a product, and R
// and N are products of two factors; N T is still an integer, and the degree is 9. If the
// floating-point pair is usable, it narrows down the vertices that can be farthest, and only these
// are multiplied out, in integers of a fixed width if the pair's numbers fit.
class ExactPair {
 public:
  // Builds the pair for the hulls and poses of `filter`. `filter` and should_stop, which may be
  // empty, must outlive the pair. Scans of many vertices poll should_stop; after stopped(), their
  // results are meaningless. with_narrow: finds the farthest vertices in integers of a fixed width
  // if the pair's numbers fit; the result is the same.
  ExactPair(const FloatPair& filter, const std::function<bool()>& should_stop,
            bool with_narrow = true);
  ~ExactPair();
  ExactPair(const ExactPair&) = delete;
  ExactPair& operator=(const ExactPair&) = delete;

  // The interface that a search requires, shared with WidePair.
  using Number = Integer;
  using Coordinates = IntegerVector;
  using Direction = IntegerVector;
  static const IntegerVector& ToDirection(const IntegerVector& n) { return n; }

  const FloatPair& filter() const { return *filter_; }
  bool stopped() const { return poll_.stopped(); }
  const QueryHull& a() const { return *a_.hull; }
  const QueryHull& b() const { return *b_.hull; }

  // The scale: an integer coordinate times 2^exponent() / norm() is the length. norm() > 0.
  int exponent() const { return exponent_; }
  const Integer& norm() const { return norm_; }
  // t_A in the same unit. Added to the shifted coordinates, it gives world coordinates.
  IntegerVector TranslationA() const;

  const IntegerVector& VertexA(uint32_t i) { return Vertex(a_, i); }
  const IntegerVector& VertexB(uint32_t i) { return Vertex(b_, i); }
  // The vertex a - b of A - B.
  ExactCorner Corner(VertexPair pair) { return {Difference(pair), pair}; }
  IntegerVector Difference(VertexPair pair) { return VertexA(pair.a) - VertexB(pair.b); }
  // Multiplies out every vertex, unless stopped(). Afterwards all functions are thread-safe if
  // should_stop is.
  void CacheAllVertices();
  // Approximate memory of the multiplied-out vertices, in bytes.
  size_t MemoryBytes() const;

  // Returns the vertices of A farthest along n, ascending.
  std::vector<uint32_t> FeatureA(const IntegerVector& n);
  // Returns the vertices of B farthest against n, ascending.
  std::vector<uint32_t> FeatureB(const IntegerVector& n);
  // Return the lowest of these vertices.
  uint32_t FarthestA(const IntegerVector& n) { return FeatureA(n).front(); }
  uint32_t FarthestB(const IntegerVector& n) { return FeatureB(n).front(); }
  // Overloads for a result known to be among `candidates`, ascending.
  uint32_t FarthestA(const IntegerVector& n, std::span<const uint32_t> candidates) {
    return FeatureA(n, candidates).front();
  }
  uint32_t FarthestB(const IntegerVector& n, std::span<const uint32_t> candidates) {
    return FeatureB(n, candidates).front();
  }

  // Returns the vertex of A - B farthest along n: the difference of the lowest such vertices of A
  // and B.
  ExactCorner Farthest(const IntegerVector& n) { return Corner({FarthestA(n), FarthestB(n)}); }

  // Returns a positive multiple of a point in the relative interior of A - B: the difference of the
  // means of the hulls' inner vertices.
  IntegerVector CenterDifference() const;

 private:
  struct Side {
    const QueryHull* hull;
    // world = matrix * own + shift.
    IntegerVector rows[3];
    IntegerVector shift;
    std::unordered_map<uint32_t, IntegerVector> vertices;
  };

  // This pair in integers of a fixed width.
  class Narrow;
  template <int kWords>
  class NarrowOf;

  std::vector<uint32_t> FeatureA(const IntegerVector& n, std::span<const uint32_t> candidates);
  std::vector<uint32_t> FeatureB(const IntegerVector& n, std::span<const uint32_t> candidates);
  static IntegerVector ToWorld(const Side& side, const IntegerVector& own);
  static const IntegerVector& Vertex(Side& side, uint32_t i);
  static IntegerVector SumOfInnerVertices(const Side& side);
  std::vector<uint32_t> Farthest(const Side& side, std::span<const uint32_t> candidates,
                                 const IntegerVector& n);
  std::vector<uint32_t> AllOf(const Side& side) const;

  const FloatPair* filter_;
  ScanPoll poll_;
  int exponent_;
  Integer norm_;
  Side a_;
  Side b_;
  // Null if the pair's numbers fit no width, or if not requested.
  std::unique_ptr<Narrow> narrow_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_
