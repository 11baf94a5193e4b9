// The same bits on every path and every processor: hashes of snapshots and of answers over
// questions from fixed seeds. Nothing here is computed by the mathematical library, whose sines may
// differ in the last bit from one processor to the next.

#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/hull/growth/hull_builder.h"
#include "core/numeric/simd_path.h"
#include "core/query/collision.h"
#include "tests/core/checks/oracle_bridge.h"
#include "tests/core/checks/point_sets.h"

namespace hulld {
namespace {

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

// Clouds of all dimensions, scales and kinds of degeneracy.
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
  // Large enough for conflict lists, the direction map and its scans.
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

void AddAnswer(Digest& digest, const Answer& answer) {
  digest.Add(static_cast<uint64_t>(answer.relation));
  digest.Add(static_cast<uint64_t>(answer.rung));
  digest.Add(uint64_t{answer.within_clearance.value()});
  digest.Add(answer.separation->value);
  digest.Add(answer.separation->bound);
  digest.Add(answer.analysis ? answer.analysis->axes_tested : 0);
  if (answer.witness) {
    digest.Add(answer.witness->p_WA);
    digest.Add(answer.witness->p_WB);
    digest.Add(answer.witness->error);
  }
  if (answer.axis) {
    digest.Add(answer.axis->direction);
    digest.Add(static_cast<uint64_t>(answer.axis->kind));
    digest.Add(answer.axis->feature_a.vertices);
    digest.Add(answer.axis->feature_b.vertices);
  }
  if (answer.certificate) {
    if (const auto* n = std::get_if<Vector>(&answer.certificate->direction)) digest.Add(*n);
    if (const auto* n = std::get_if<IntegerVector>(&answer.certificate->direction)) {
      for (int i = 0; i < 3; ++i) digest.Add((*n)[i].str());
    }
    for (const VertexPair& pair : answer.certificate->pairs) {
      digest.Add(uint64_t{pair.a});
      digest.Add(uint64_t{pair.b});
    }
  }
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

struct Digests {
  Digest inputs;
  Digest snapshots;
  Digest answers;
};

Digests Compute() {
  Digests digests;
  std::vector<Hull> hulls;
  for (const std::vector<Vector>& cloud : Clouds()) {
    for (const Vector& p : cloud) digests.inputs.Add(p);
    HullBuilder builder;
    EXPECT_TRUE(builder.Add(cloud).ok());
    hulls.push_back(builder.Snapshot());
    AddHull(digests.snapshots, hulls.back());
  }
  QueryOptions options;
  options.want_axis = true;
  options.want_analysis = true;
  options.want_certificate = true;
  options.want_separation = true;
  options.want_witness = true;
  options.clearance = 1e-3;
  Random random(1724);
  size_t counts[4] = {};
  const auto ask = [&](const Hull& a, const Pose& X_WA, const Hull& b, const Pose& X_WB) {
    const Answer answer = CheckCollision(a, X_WA, b, X_WB, options).value();
    AddAnswer(digests.answers, answer);
    ++counts[static_cast<size_t>(answer.relation)];
  };
  // Textbook questions about the last hull, the largest, take long.
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
    EXPECT_GT(counts[relation], 5u) << "a relation is hardly met";
  }
  return digests;
}

class DigestTest : public testing::TestWithParam<SimdPath> {};

TEST_P(DigestTest, IsThatOfEveryProcessor) {
  const SimdPath before = CurrentSimdPath();
  if (!UseSimdPath(GetParam())) GTEST_SKIP() << "this machine has no such instructions";
  const Digests digests = Compute();
  UseSimdPath(before);
  EXPECT_EQ(digests.inputs.hash(), 7004395885791083578u) << "the questions differ";
  EXPECT_EQ(digests.snapshots.hash(), 13234861685057146501u);
  EXPECT_EQ(digests.answers.hash(), 16922643402919350732u);
}

INSTANTIATE_TEST_SUITE_P(Paths, DigestTest,
                         testing::Values(SimdPath::kPortable, SimdPath::kAvx2, SimdPath::kNeon),
                         [](const auto& path) -> std::string {
                           switch (path.param) {
                             case SimdPath::kPortable:
                               return "Portable";
                             case SimdPath::kAvx2:
                               return "Avx2";
                             case SimdPath::kNeon:
                               return "Neon";
                           }
                           return "";
                         });

}  // namespace
}  // namespace hulld
