#ifndef HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_
#define HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

#include "core/hull/hull.h"
#include "core/numeric/integer.h"
#include "core/query/floating/float_pair.h"
#include "core/query/terms/minkowski_vertex.h"
#include "core/query/terms/vertex_pair.h"

namespace hulld {

using ExactCorner = MinkowskiVertex<IntegerVector>;

// A pair of posed hulls in integers, exactly.
//
// With Q the quaternions' integers and N = |Q|^2, the world coordinates, shifted by -t_A and
// multiplied by N_A N_B and a power of two, are integers: N_B R(Q_A) P_A for A, and N_A R(Q_B) P_B
// + N_A N_B (T_B - T_A) for B; or by N_A alone where N_A = N_B. Degree 5 in the input; some 280
// bits at a common exponent. For a piece of a body, whose pose is a product, R and N are the
// products of two, and N T is an integer all the same: degree 9. The floating-point pair, where it
// is usable, narrows down which vertices can be farthest, so that only these are multiplied out; in
// integers of a fixed width where these hold the pair's numbers.
class ExactPair {
 public:
  // Makes the pair for the hulls and poses of `filter`, which must outlive it. with_narrow: whether
  // the farthest vertices are found in integers of a fixed width where these hold the pair's
  // numbers; they are the same vertices.
  explicit ExactPair(const FloatPair& filter, bool with_narrow = true);
  ~ExactPair();
  ExactPair(const ExactPair&) = delete;
  ExactPair& operator=(const ExactPair&) = delete;

  // What a search asks of its pair: this one, or WidePair.
  using Number = Integer;
  using Coordinates = IntegerVector;
  using Direction = IntegerVector;
  static const IntegerVector& ToDirection(const IntegerVector& n) { return n; }

  const FloatPair& filter() const { return *filter_; }
  const QueryHull& a() const { return *a_.hull; }
  const QueryHull& b() const { return *b_.hull; }

  // The scale: an integer coordinate times 2^exponent() / norm() is the length. norm() > 0.
  int exponent() const { return exponent_; }
  const Integer& norm() const { return norm_; }
  // t_A in the same unit: what turns the shifted coordinates into world coordinates.
  IntegerVector TranslationA() const;

  const IntegerVector& VertexA(uint32_t i) { return Vertex(a_, i); }
  const IntegerVector& VertexB(uint32_t i) { return Vertex(b_, i); }
  // The vertex a - b of A - B.
  ExactCorner Corner(VertexPair pair) { return {Difference(pair), pair}; }
  IntegerVector Difference(VertexPair pair) { return VertexA(pair.a) - VertexB(pair.b); }
  // Multiplies out every vertex: from then on all functions may be called by several threads at
  // once.
  void CacheAllVertices();
  // About what the vertices that were multiplied out take. Bytes.
  size_t MemoryBytes() const;

  // The vertices of A farthest along n, ascending.
  std::vector<uint32_t> FeatureA(const IntegerVector& n);
  // The vertices of B farthest against n, ascending.
  std::vector<uint32_t> FeatureB(const IntegerVector& n);
  // The lowest of them.
  uint32_t FarthestA(const IntegerVector& n) { return FeatureA(n).front(); }
  uint32_t FarthestB(const IntegerVector& n) { return FeatureB(n).front(); }
  // The same when it is known to be among `candidates`, ascending.
  uint32_t FarthestA(const IntegerVector& n, std::span<const uint32_t> candidates) {
    return FeatureA(n, candidates).front();
  }
  uint32_t FarthestB(const IntegerVector& n, std::span<const uint32_t> candidates) {
    return FeatureB(n, candidates).front();
  }

  // The vertex of A - B farthest along n: the one made of the lowest such vertex of A and that of
  // B.
  ExactCorner Farthest(const IntegerVector& n) { return Corner({FarthestA(n), FarthestB(n)}); }

  // A positive multiple of a point in the relative interior of A - B: the difference of the means
  // of the hulls' inner vertices.
  IntegerVector CenterDifference() const;

 private:
  struct Side {
    const QueryHull* hull;
    // world = matrix * own + shift.
    IntegerVector rows[3];
    IntegerVector shift;
    std::unordered_map<uint32_t, IntegerVector> vertices;
  };

  // The same pair in integers of a fixed width.
  class Narrow;
  template <int kWords>
  class NarrowOf;

  std::vector<uint32_t> FeatureA(const IntegerVector& n, std::span<const uint32_t> candidates);
  std::vector<uint32_t> FeatureB(const IntegerVector& n, std::span<const uint32_t> candidates);
  static IntegerVector ToWorld(const Side& side, const IntegerVector& own);
  static const IntegerVector& Vertex(Side& side, uint32_t i);
  static IntegerVector SumOfInnerVertices(const Side& side);
  static std::vector<uint32_t> Farthest(Side& side, std::span<const uint32_t> candidates,
                                        const IntegerVector& n);
  std::vector<uint32_t> AllOf(const Side& side) const;

  const FloatPair* filter_;
  int exponent_;
  Integer norm_;
  Side a_;
  Side b_;
  // Null where no width holds its numbers, or not asked for.
  std::unique_ptr<Narrow> narrow_;
};

}  // namespace hulld

#endif  // HULLD_CORE_QUERY_EXACT_EXACT_PAIR_H_
