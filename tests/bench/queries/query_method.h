#ifndef HULLD_TESTS_BENCH_QUERIES_QUERY_METHOD_H_
#define HULLD_TESTS_BENCH_QUERIES_QUERY_METHOD_H_

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/hull/hull.h"
#include "tests/bench/queries/query_sets.h"

namespace hulld::bench {

enum class Verdict : uint8_t {
  kApart,
  kColliding,  // touching or overlapping
  kOpen,       // neither was claimed
};

// A way to decide if placed hulls collide: hulld, a peer library, or an uncertified method.
// Everything independent of a query is converted to the method's own types beforehand: hulls in
// Prepare, poses when they are placed.
class QueryMethod {
 public:
  virtual ~QueryMethod() = default;

  virtual const std::string& name() const = 0;
  // Sets the queries and converts them. Both must outlive their use.
  virtual void Prepare(const std::deque<Hull>& hulls,
                       const std::vector<QuerySet::Query>& queries) = 0;
  // Answers one query per verdict, starting with query `first`, from placed hulls.
  virtual void Answer(size_t first, std::span<Verdict> verdicts) = 0;
  // Like Answer, but from poses; their conversion is part of the work.
  virtual void AnswerFromPoses(size_t first, std::span<Verdict> verdicts) = 0;
  // True if MeasureDepths is supported.
  virtual bool knows_depth() const = 0;
  // Measures the penetration depth for each query; no value if the method reports none, for example
  // because it finds the hulls separated. Includes the results of the method's usual contact query:
  // normal and witness points.
  virtual void MeasureDepths(size_t first, std::span<std::optional<double>> depths) = 0;
  virtual bool knows_distance() const = 0;
  // Like MeasureDepths, but for the distance of separated hulls.
  virtual void MeasureDistances(size_t first, std::span<std::optional<double>> distances) = 0;
};

// A method from a library with
//   Shape, Placed: a hull, and a hull at a pose, in its own types;
//   std::unique_ptr<Shape> MakeShape(const Hull&); Placed Place(const Shape&, const Pose&);
//   Verdict Decide(const Placed&, const Placed&); and, if supported,
//   std::optional<double> Depth(const Placed&, const Placed&), and Distance likewise.
template <typename Library>
class MethodOf final : public QueryMethod {
 public:
  MethodOf(std::string name, Library library)
      : name_(std::move(name)), library_(std::move(library)) {}

  const std::string& name() const override { return name_; }

  void Prepare(const std::deque<Hull>& hulls,
               const std::vector<QuerySet::Query>& queries) override {
    a_.clear();
    b_.clear();
    shapes_.clear();
    queries_ = &queries;
    for (const Hull& hull : hulls) shapes_.push_back(library_.MakeShape(hull));
    for (const QuerySet::Query& query : queries) {
      a_.push_back(library_.Place(*shapes_[query.hull_a], query.X_WA));
      b_.push_back(library_.Place(*shapes_[query.hull_b], query.X_WB));
    }
  }

  void Answer(size_t first, std::span<Verdict> verdicts) override {
    for (size_t i = 0; i < verdicts.size(); ++i) {
      verdicts[i] = library_.Decide(a_[first + i], b_[first + i]);
    }
  }

  void AnswerFromPoses(size_t first, std::span<Verdict> verdicts) override {
    for (size_t i = 0; i < verdicts.size(); ++i) {
      const QuerySet::Query& query = (*queries_)[first + i];
      verdicts[i] = library_.Decide(library_.Place(*shapes_[query.hull_a], query.X_WA),
                                    library_.Place(*shapes_[query.hull_b], query.X_WB));
    }
  }

  bool knows_depth() const override {
    return requires(Library l, Placed p) { l.Depth(p, p); };
  }
  void MeasureDepths(size_t first, std::span<std::optional<double>> depths) override {
    if constexpr (requires(Library l, Placed p) { l.Depth(p, p); }) {
      for (size_t i = 0; i < depths.size(); ++i) {
        depths[i] = library_.Depth(a_[first + i], b_[first + i]);
      }
    }
  }

  bool knows_distance() const override {
    return requires(Library l, Placed p) { l.Distance(p, p); };
  }
  void MeasureDistances(size_t first, std::span<std::optional<double>> distances) override {
    if constexpr (requires(Library l, Placed p) { l.Distance(p, p); }) {
      for (size_t i = 0; i < distances.size(); ++i) {
        distances[i] = library_.Distance(a_[first + i], b_[first + i]);
      }
    }
  }

 private:
  using Shape = typename Library::Shape;
  using Placed = typename Library::Placed;

  std::string name_;
  Library library_;
  std::vector<std::unique_ptr<Shape>> shapes_;
  const std::vector<QuerySet::Query>* queries_ = nullptr;
  std::vector<Placed> a_;
  std::vector<Placed> b_;
};

// Returns the signed separation of non-empty hulls to the precision of a double: computed by hulld
// to within 1e-15 of the hulls' sizes, far below its default error and that of other methods.
double BestSeparation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

// Returns hulld itself.
std::unique_ptr<QueryMethod> MakeHulld();
// Returns hulld with a tolerance, which is also the max_error of depths and distances.
std::unique_ptr<QueryMethod> MakeHulldWithin(double tolerance, std::string name);
// Returns hulld, exact, on inner simplifications of the hulls with an error of at most max_error:
// never reports a false collision.
std::unique_ptr<QueryMethod> MakeHulldSimplified(double max_error, std::string name);

// The separating axis test as taught in courses: transforms all points into the world, then
// projects every point on facet normals and cross products of edges; early exit, no certificate.
// perturbation: each coordinate changes by a random fraction of itself, at most this; a common
// workaround for degenerate input.
std::unique_ptr<QueryMethod> MakeTextbookInDouble(double perturbation = 0);

// GJK that stops once it knows the sign of the separation; without error bounds or a certificate.
std::unique_ptr<QueryMethod> MakePlainGjkInDouble();
std::unique_ptr<QueryMethod> MakePlainGjkInFloat();

// Returns the peers available at build time, each in the modes that its users choose: FCL (libccd's
// solver and its own), libccd (MPR and GJK), Bullet (double precision, margin 0).
std::vector<std::unique_ptr<QueryMethod>> MakePeers();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_QUERY_METHOD_H_
