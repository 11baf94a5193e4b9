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

// One way to ask whether placed hulls collide: hulld, a peer library, or a method that can be
// wrong. Everything that does not depend on a question is converted to the method's own types
// before: hulls when they are given, poses when they are placed.
class QueryMethod {
 public:
  virtual ~QueryMethod() = default;

  virtual const std::string& name() const = 0;
  // Sets the questions and converts them. Both must outlive their use.
  virtual void Prepare(const std::deque<Hull>& hulls,
                       const std::vector<QuerySet::Query>& queries) = 0;
  // Answers as many questions as there are verdicts, beginning with question `first`, from placed
  // hulls.
  virtual void Answer(size_t first, std::span<Verdict> verdicts) = 0;
  // The same from poses, whose conversion is part of the work.
  virtual void AnswerFromPoses(size_t first, std::span<Verdict> verdicts) = 0;
  // Whether MeasureDepths can be asked.
  virtual bool knows_depth() const = 0;
  // The penetration depth for each question, without a value where the method finds none (as where
  // it finds the hulls apart), together with what the method's usual contact query finds: normal
  // and witness points.
  virtual void MeasureDepths(size_t first, std::span<std::optional<double>> depths) = 0;
  virtual bool knows_distance() const = 0;
  // The same for the distance of hulls apart.
  virtual void MeasureDistances(size_t first, std::span<std::optional<double>> distances) = 0;
};

// A method from a library with
//   Shape, Placed: a hull, and a hull at a pose, in its own types;
//   std::unique_ptr<Shape> MakeShape(const Hull&); Placed Place(const Shape&, const Pose&);
//   Verdict Ask(const Placed&, const Placed&); and where it has them
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
      verdicts[i] = library_.Ask(a_[first + i], b_[first + i]);
    }
  }

  void AnswerFromPoses(size_t first, std::span<Verdict> verdicts) override {
    for (size_t i = 0; i < verdicts.size(); ++i) {
      const QuerySet::Query& query = (*queries_)[first + i];
      verdicts[i] = library_.Ask(library_.Place(*shapes_[query.hull_a], query.X_WA),
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

// The signed separation of hulls that are not empty, as well as a double holds it: hulld's, asked
// for an error of 1e-15 of the hulls' sizes, far below its default and that of other methods.
double BestSeparation(const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB);

// hulld itself.
std::unique_ptr<QueryMethod> MakeHulld();
// The same with QueryOptions::tolerance.
std::unique_ptr<QueryMethod> MakeHulldWithin(double tolerance, std::string name);
// hulld, exactly, on hulls simplified from inside to within max_error: never finds a collision too
// many.
std::unique_ptr<QueryMethod> MakeHulldSimplified(double max_error, std::string name);

// The separating axis test as coursework has it: all points into the world, then facet normals and
// cross products of edges, every point projected on each, early exit, no certificate.
// `perturbation` moves each coordinate by a random part of itself of up to that size, a common cure
// for degenerate input.
std::unique_ptr<QueryMethod> MakeTextbookInDouble(double perturbation = 0);

// GJK to the sign, without any bound or certificate.
std::unique_ptr<QueryMethod> MakePlainGjkInDouble();
std::unique_ptr<QueryMethod> MakePlainGjkInFloat();

// The peers that were there when this was built, each in the modes that its users choose: FCL
// (libccd's solver and its own), libccd (MPR and GJK), Bullet (double precision, margin 0).
std::vector<std::unique_ptr<QueryMethod>> MakePeers();

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_QUERIES_QUERY_METHOD_H_
