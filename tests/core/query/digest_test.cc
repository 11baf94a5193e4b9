// Results are bitwise equal on every path and processor: hashes of snapshots, answers, and other
// results of hulls, over queries from fixed seeds. Nothing here uses the math library: its sines
// may differ in the last bit between processors.

#include <gtest/gtest.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/hull/simplification/simplify.h"
#include "core/numeric/simd_path.h"
#include "core/query/body/body_search.h"
#include "core/query/collision.h"
#include "core/query/placed/live_hull.h"
#include "core/query/scene/scene.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"
#include "tests/core/query/body/own_body.h"

namespace hulld {
namespace digest_test {

// FNV-1a over 64-bit words.
class Digest {
 public:
  void Add(uint64_t word) {
    for (int i = 0; i < 64; i += 8) {
      hash_ = (hash_ ^ ((word >> i) & 0xff)) * 0x100000001b3;
    }
  }
  void Add(double value) { Add(std::bit_cast<uint64_t>(value)); }
  void Add(const Vector& v) {
    for (int i = 0; i < 3; ++i) Add(v[i]);
  }
  void Add(std::span<const uint32_t> indices) {
    Add(uint64_t{indices.size()});
    for (const uint32_t i : indices) Add(uint64_t{i});
  }
  void Add(const std::string& text) {
    for (const char c : text) Add(uint64_t{static_cast<unsigned char>(c)});
  }
  uint64_t hash() const { return hash_; }

 private:
  uint64_t hash_ = 0xcbf29ce484222325;
};

// Clouds of all dimensions, scales, and kinds of degeneracy.
std::vector<std::vector<Vector>> Clouds() {
  Random random(1723);
  std::vector<std::vector<Vector>> clouds;
  for (int i = 0; i < 8; ++i) {
    clouds.push_back(RandomLatticePoints(random, 4 + 6 * i, 3 + i));
    clouds.push_back(RandomInBall(random, 8 + 40 * i, 1));
    clouds.push_back(Shifted(RandomInCube(random, 30, 1), Vector(1e6, -3e5, 0.1)));
    clouds.push_back(RandomFlatPoints(random, 20, i % 4));
    clouds.push_back(Scaled(RandomOnSphere(random, 60, 1), i % 2 == 0 ? 0x1p-20 : 0x1p20));
  }
  clouds.push_back(LatticeCube(4, 0.1));
  clouds.push_back(IntegerParaboloid(6));
  clouds.push_back(Scaled(RandomOnSphere(random, 50, 1), 0x1p-1060));
  clouds.push_back(Scaled(RandomOnSphere(random, 50, 1), 0x1p1000));
  // Large enough for conflict lists, the direction map, and its scans.
  clouds.push_back(RandomInBall(random, 4000, 1));
  return clouds;
}

void AddHull(Digest& digest, const Hull& hull) {
  digest.Add(static_cast<uint64_t>(hull.dimension()));
  for (const Vector& v : hull.vertices()) digest.Add(v);
  for (size_t i = 0; i < hull.facet_count(); ++i) digest.Add(hull.facet(i));
  for (const Edge& edge : hull.edges()) {
    digest.Add(uint64_t{edge.tail});
    digest.Add(uint64_t{edge.head});
  }
  digest.Add(hull.center());
}

void AddCertificate(Digest& digest, const Certificate& certificate) {
  if (const auto* n = std::get_if<Vector>(&certificate.direction)) digest.Add(*n);
  if (const auto* n = std::get_if<IntegerVector>(&certificate.direction)) {
    for (int i = 0; i < 3; ++i) digest.Add((*n)[i].str());
  }
  for (const VertexPair& pair : certificate.pairs) {
    digest.Add(uint64_t{pair.a});
    digest.Add(uint64_t{pair.b});
  }
}

void AddAnswer(Digest& digest, const Answer& answer) {
  digest.Add(static_cast<uint64_t>(answer.relation));
  digest.Add(static_cast<uint64_t>(answer.rung));
  if (answer.within_clearance) digest.Add(uint64_t{*answer.within_clearance});
  if (answer.separation) {
    digest.Add(answer.separation->value);
    digest.Add(answer.separation->bound);
  }
  digest.Add(answer.analysis ? answer.analysis->axes_tested : 0);
  if (answer.witness) {
    digest.Add(answer.witness->p_WA);
    digest.Add(answer.witness->p_WB);
    digest.Add(answer.witness->error);
  }
  if (answer.normal) {
    digest.Add(answer.normal->direction);
    digest.Add(answer.normal->angle_bound);
  }
  if (answer.axis) {
    digest.Add(answer.axis->direction);
    digest.Add(static_cast<uint64_t>(answer.axis->kind));
    digest.Add(answer.axis->feature_a.vertices);
    digest.Add(answer.axis->feature_b.vertices);
  }
  if (answer.certificate) AddCertificate(digest, *answer.certificate);
}

Pose RandomPose(Random& random, double size) {
  Pose pose;
  for (double& component : pose.q) component = random.Real(-1, 1);
  for (int i = 0; i < 3; ++i) pose.t[i] = random.Real(-1, 1) * size;
  return pose;
}

// Without rotation, so that lattices touch exactly.
Pose LatticePose(Random& random) {
  Pose pose;
  for (int i = 0; i < 3; ++i) pose.t[i] = random.Between(-3, 3);
  return pose;
}

QueryOptions Everything() {
  QueryOptions options;
  options.want_axis = true;
  options.want_analysis = true;
  options.want_certificate = true;
  options.want_separation = true;
  options.want_witness = true;
  options.want_normal = true;
  options.clearance = 1e-3;
  return options;
}

// By the name of the result.
using Digests = std::map<std::string, Digest>;

std::vector<Hull> DigestSnapshots(Digests& digests) {
  std::vector<Hull> hulls;
  for (const std::vector<Vector>& cloud : Clouds()) {
    for (const Vector& p : cloud) digests["queries"].Add(p);
    HullBuilder builder;
    EXPECT_TRUE(builder.Add(cloud).ok());
    hulls.push_back(builder.Snapshot());
    AddHull(digests["snapshots"], hulls.back());
  }
  return hulls;
}

void DigestAnswers(std::span<const Hull> hulls, Digest& digest) {
  const QueryOptions options = Everything();
  Random random(1724);
  size_t counts[4] = {};
  const auto ask = [&](const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
    const Answer answer = CheckCollision(a, X_WA, b, X_WB, options).value();
    AddAnswer(digest, answer);
    ++counts[static_cast<size_t>(answer.relation)];
  };
  // Textbook queries about the last hull, the largest, take long.
  const auto few = static_cast<int>(hulls.size()) - 1;
  for (int i = 0; i < 300; ++i) {
    const Hull& a = hulls[random.Below(few)];
    const Hull& b = i % 2 == 0 ? a : hulls[random.Below(few)];
    const Pose X_WA = RandomPose(random, a.max_abs_coordinate());
    const Pose X_WB = RandomPose(random, a.max_abs_coordinate());
    ask(a, X_WA, b, X_WB);
  }
  // The smallest lattices.
  for (int i = 0; i < 100; ++i) {
    const Hull& a = hulls[5 * random.Below(2)];
    const Hull& b = hulls[5 * random.Below(2)];
    const Pose X_WA = LatticePose(random);
    ask(a, X_WA, b, LatticePose(random));
  }
  for (int relation = 0; relation < 3; ++relation) {
    EXPECT_GT(counts[relation], 5u) << "a relation occurs too rarely";
  }
}

// Queries of the relation alone, which center bounds may decide, with a cache that queries warm;
// and all other queries on hulls with thousands of vertices, which scan candidate lists.
void DigestLargeHulls(Digest& digest) {
  Random random(1725);
  std::deque<Hull> hulls;
  std::deque<QueryHull> query_hulls;
  for (const int vertices : {100, 700, 4000}) {
    hulls.push_back(BuildHull(RandomOnSphere(random, vertices, 1)));
    std::vector<Vector> slender = RandomOnSphere(random, vertices, 1);
    for (Vector& p : slender) p = Vector(p.x(), 0.1 * p.y(), 1e-3 * p.z());
    hulls.push_back(BuildHull(slender));
  }
  for (const Hull& hull : hulls) query_hulls.emplace_back(hull);
  size_t rungs[kRungCount] = {};
  const auto ask = [&](const PlacedHull& a, const PlacedHull& b, const QueryOptions& options,
                       PairCache* cache) {
    const Answer answer = CheckCollision(a, b, options, cache).value();
    AddAnswer(digest, answer);
    ++rungs[static_cast<size_t>(answer.rung)];
  };
  QueryOptions near;
  near.clearance = 0.25;
  for (const QueryHull& query_a : query_hulls) {
    for (const QueryHull& query_b : query_hulls) {
      const PlacedHull a(query_a, RandomPose(random, 1));
      Pose X_WB = RandomPose(random, 2);
      const Vector step = 0.25 * (a.X_WH().t - X_WB.t);
      PairCache cache;
      // Past the other hull and out of it again.
      for (int i = 0; i < 8; ++i) {
        X_WB.t += step;
        const PlacedHull b(query_b, X_WB);
        ask(a, b, {}, nullptr);
        ask(a, b, {}, &cache);
        ask(a, b, near, &cache);
        if (i % 4 == 0) ask(a, b, Everything(), nullptr);
      }
    }
  }
  for (const Rung rung : {Rung::kBounds, Rung::kCached, Rung::kFloatingPoint}) {
    EXPECT_GT(rungs[static_cast<size_t>(rung)], 20u) << "rung " << static_cast<int>(rung);
  }
}

// Digests the counts of each block's points, and queries about growing hulls.
void DigestGrowth(Digest& digest) {
  Random random(1726);
  const Hull probe = BuildHull(RandomOnSphere(random, 60, 0.5));
  const QueryHull query_probe(probe);
  for (const double flatness : {1.0, 1e-2, 1e-9, 0.0}) {
    HullBuilder builder;
    LiveHull live;
    for (int block = 0; block < 12; ++block) {
      // A few blocks of the size of a camera's frame among small ones.
      std::vector<Vector> points = RandomInBall(random, block % 4 == 3 ? 3000 : 40, 1 + block);
      for (Vector& p : points) p.z() *= flatness;
      const PointCounts counts = builder.Add(points).value();
      digest.Add(counts.outside);
      digest.Add(counts.duplicate);
      digest.Add(counts.inside);
      const LiveHull::Mark mark = live.Append(builder.NewVertices(), builder.dimension());
      const std::shared_ptr<const QueryHull> version = live.VersionAt(mark);
      for (int i = 0; i < 10; ++i) {
        const PlacedHull a(*version, RandomPose(random, 1 + block));
        const PlacedHull b(query_probe, RandomPose(random, 1 + block));
        AddAnswer(digest, CheckCollision(a, b).value());
      }
      if (live.WantsPreparing(mark)) live.Prepare(mark);
      digest.Add(live.points_moved());
    }
    AddHull(digest, builder.Snapshot());
  }
}

void AddBodyAnswer(Digest& digest, const BodyAnswer& found) {
  AddAnswer(digest, found.answer);
  if (found.pieces) {
    digest.Add(uint64_t{found.pieces->a});
    digest.Add(uint64_t{found.pieces->b});
  }
  for (const PieceCertificate& piece : found.certificates) {
    digest.Add(uint64_t{piece.pieces.a});
    digest.Add(uint64_t{piece.pieces.b});
    AddCertificate(digest, piece.certificate);
  }
}

// Lattices, rounded pieces anywhere, and grids of cubes with many equally near pairs: rounding then
// decides the first.
void DigestBodies(Digest& digest) {
  Random random(1727);
  std::deque<OwnBody> bodies(6);
  for (size_t k = 0; k < 4; ++k) {
    for (int i = 0; i < 60; ++i) {
      const Pose X_BP = k < 2 ? LatticePose(random) : RandomPose(random, 3);
      bodies[k].Add(
          k < 2 ? RandomLatticePoints(random, 1 + i % 6, 3) : RandomOnSphere(random, 4 + i, 0.5),
          X_BP);
    }
    bodies[k].Finish();
  }
  for (size_t k = 4; k < 6; ++k) FillGrid(5, 1.25, &bodies[k]);
  QueryOptions proof;
  proof.want_certificate = true;
  QueryOptions separation = Everything();
  separation.want_certificate = false;
  size_t counts[4] = {};
  for (int i = 0; i < 120; ++i) {
    const size_t first = 2 * (i % 3);
    const Pose X_WA = first == 0 ? LatticePose(random) : RandomPose(random, 2);
    Pose X_WB = first == 0 ? LatticePose(random) : RandomPose(random, 2);
    // Equal rotations, so that faces are parallel and distances equal.
    if (first == 4 && i % 2 == 0) X_WB.q = X_WA.q;
    // From deep overlap to separation.
    X_WB.t.x() += i % 10;
    const PlacedBody a = bodies[first].Placed(X_WA);
    const PlacedBody b = bodies[first + 1].Placed(X_WB);
    for (const QueryOptions& options : {QueryOptions(), proof, separation}) {
      BodyCounts looked_at;
      const BodyAnswer found = CheckBodies(a, b, options, &looked_at).value();
      AddBodyAnswer(digest, found);
      digest.Add(looked_at.boxes);
      digest.Add(looked_at.pairs);
      ++counts[static_cast<size_t>(found.answer.relation)];
    }
  }
  for (int relation = 0; relation < 3; ++relation) {
    EXPECT_GT(counts[relation], 5u) << "a relation of bodies occurs too rarely";
  }
}

void DigestScenes(std::span<const Hull> hulls, Digest& digest) {
  Random random(1728);
  std::deque<QueryHull> query_hulls;
  // Small ones, of all dimensions.
  for (size_t i = 0; i < 40; ++i) {
    if (hulls[i].max_abs_coordinate() < 20) query_hulls.emplace_back(hulls[i]);
  }
  std::vector<PlacedHull> placements;
  for (int i = 0; i < 150; ++i) {
    const QueryHull& hull = query_hulls[random.Below(static_cast<int>(query_hulls.size()))];
    Pose pose = i % 2 == 0 ? LatticePose(random) : RandomPose(random, 1);
    for (double& t : pose.t) t += random.Between(-9, 9);
    placements.emplace_back(hull, pose);
  }
  SceneOptions options;
  options.query = Everything();
  options.threads = 2;
  const SceneTotals totals =
      FindCollisions(placements, options, [&](std::span<const SceneAnswer> answers) {
        for (const SceneAnswer& found : answers) {
          digest.Add(uint64_t{found.pair.a});
          digest.Add(uint64_t{found.pair.b});
          AddAnswer(digest, found.answer.value());
        }
      }).value();
  digest.Add(totals.candidates);
  for (const uint64_t count : totals.rungs.by_rung) digest.Add(count);
  EXPECT_GT(totals.found, 100u);
}

void DigestSimplifications(std::span<const Hull> hulls, Digest& digest) {
  for (size_t i = 0; i < hulls.size(); i += 3) {
    SimplifyTarget few;
    few.max_vertices = 12;
    SimplifyTarget near;
    near.max_error = hulls[i].max_abs_coordinate() / 16;
    for (const SimplifyTarget& target : {few, near}) {
      for (const auto simplify : {SimplifyInside, SimplifyOutside}) {
        const SimplifiedHull simple = simplify(hulls[i], target).value();
        AddHull(digest, simple.hull);
        digest.Add(simple.error);
      }
    }
  }
}

Digests Compute() {
  Digests digests;
  const std::vector<Hull> hulls = DigestSnapshots(digests);
  DigestAnswers(hulls, digests["answers"]);
  DigestLargeHulls(digests["large hulls"]);
  DigestGrowth(digests["growth"]);
  DigestBodies(digests["bodies"]);
  DigestScenes(hulls, digests["scenes"]);
  DigestSimplifications(hulls, digests["simplifications"]);
  return digests;
}

class DigestTest : public testing::TestWithParam<SimdPath> {};

TEST_P(DigestTest, IsTheSameOnEveryProcessor) {
  const SimdPath before = CurrentSimdPath();
  if (!UseSimdPath(GetParam())) GTEST_SKIP() << "this machine does not support these instructions";
  const Digests digests = Compute();
  UseSimdPath(before);
  std::map<std::string, uint64_t> hashes;
  for (const auto& [what, digest] : digests) hashes[what] = digest.hash();
  const std::map<std::string, uint64_t> expected = {
      {"queries", 7004395885791083578u},  {"snapshots", 13234861685057146501u},
      {"answers", 15290388888727315273u}, {"large hulls", 4544189705481007756u},
      {"growth", 18348015413602966233u},  {"bodies", 15277098971777882199u},
      {"scenes", 17493975837864731952u},  {"simplifications", 12435222911359296737u},
  };
  EXPECT_EQ(hashes, expected);
}

INSTANTIATE_TEST_SUITE_P(Paths, DigestTest,
                         testing::Values(SimdPath::kPortable, SimdPath::kAvx2, SimdPath::kAvx512,
                                         SimdPath::kNeon),
                         [](const auto& path) -> std::string {
                           switch (path.param) {
                             case SimdPath::kPortable:
                               return "Portable";
                             case SimdPath::kAvx2:
                               return "Avx2";
                             case SimdPath::kAvx512:
                               return "Avx512";
                             case SimdPath::kNeon:
                               return "Neon";
                           }
                           return "";
                         });

}  // namespace digest_test
}  // namespace hulld
