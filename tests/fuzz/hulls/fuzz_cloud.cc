#include "tests/fuzz/hulls/fuzz_cloud.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "tests/fuzz/byte_reader.h"

namespace hulld::fuzz {
namespace {

constexpr size_t kKinds = 13;

// Magnitudes in one program: about 1, about one power of two, or any.
enum class Magnitudes { kTame, kCommon, kAny };

// The last is rare and uses few points, because it needs integers of thousands of bits.
constexpr Magnitudes kChoices[] = {Magnitudes::kTame,   Magnitudes::kTame,   Magnitudes::kTame,
                                   Magnitudes::kTame,   Magnitudes::kCommon, Magnitudes::kCommon,
                                   Magnitudes::kCommon, Magnitudes::kAny};
constexpr size_t kMaxUnlikePoints = 120;

class Decoder {
 public:
  explicit Decoder(std::span<const uint8_t> bytes) : in_(bytes) {}

  FuzzCloud Run() {
    Scatter cuts(in_.Byte());
    const int longest = in_.Byte() % 2 == 0 ? 12 : static_cast<int>(kMaxPoints);
    magnitudes_ = kChoices[in_.Below(std::size(kChoices))];
    const size_t most = magnitudes_ == Magnitudes::kAny ? kMaxUnlikePoints : kMaxPoints;
    common_power_ = in_.PowerOfTwo();
    while (!in_.empty() && cloud_.points.size() < most) Step();
    cloud_.points.resize(std::min(cloud_.points.size(), most));
    for (size_t rest = cloud_.points.size(); rest > 0;) {
      const size_t n = std::min(rest, static_cast<size_t>(cuts.Between(1, longest)));
      cloud_.block_sizes.push_back(n);
      rest -= n;
    }
    return std::move(cloud_);
  }

 private:
  void Step() {
    switch (in_.Below(kKinds)) {
      case 0:
        return Add(ScaledIntegers());
      case 1:
        return magnitudes_ == Magnitudes::kAny ? AddRaw() : Add(ScaledIntegers());
      case 2:
        return Add(Earlier());
      case 3:
        return AddNeighbor();
      case 4:
        return AddOnLine();
      case 5:
        return AddParallelogram();
      case 6:
        return AddWithOneCoordinateOf();
      case 7:
        return AddDecimals();
      case 8:
        return AddRun();
      case 9:
        return AddGrid();
      case 10:
        return AddScatter();
      case 11:
        return AddParaboloid();
      default:
        return AddFarAlongAxis();
    }
  }

  void Add(const Vector& p) { cloud_.points.push_back(p); }
  Vector Earlier() {
    const size_t back = in_.Byte();
    const size_t n = cloud_.points.size();
    return n == 0 ? Vector::Zero().eval() : cloud_.points[n - 1 - back % n];
  }
  // Each byte is read in a separate statement: compilers differ in the evaluation order of
  // operands.
  Vector ScaledIntegers() {
    const double x = in_.SmallInteger();
    const double y = in_.SmallInteger();
    const double z = in_.SmallInteger();
    return Power() * Vector(x, y, z);
  }

  void AddRaw() {
    const double x = in_.Raw();
    const double y = in_.Raw();
    Add(Vector(x, y, in_.Raw()));
  }
  void AddParallelogram() {
    const Vector a = Earlier();
    const Vector b = Earlier();
    Add(a + b - Earlier());
  }
  void AddNeighbor() {
    Vector p = Earlier();
    const uint8_t which = in_.Byte();
    double& x = p[which % 3];
    x = std::nextafter(x, which & 4 ? kInfinity : -kInfinity);
    Add(p);
  }
  // Adds a point on the line through two points, up to rounding.
  void AddOnLine() {
    const Vector a = Earlier();
    const Vector b = Earlier();
    Add(a + (in_.SignedByte() / 7) * (b - a));
  }
  void AddWithOneCoordinateOf() {
    Vector p = Earlier();
    const Vector other = Earlier();
    const size_t k = in_.Below(3);
    p[static_cast<int>(k)] = other[static_cast<int>(k)];
    Add(p);
  }
  void AddDecimals() {
    const double x = in_.SignedByte();
    const double y = in_.SignedByte();
    const double z = in_.SignedByte();
    const double offset = 1e6 * in_.SmallInteger();
    Add(Power() * Vector(0.1 * x + offset, 0.1 * y + offset, 0.1 * z + offset));
  }
  void AddRun() {
    const Vector start = Earlier();
    const Vector step = ScaledIntegers();
    const size_t n = in_.Below(24);
    for (size_t i = 1; i <= n; ++i) Add(start + static_cast<double>(i) * step);
  }
  void AddGrid() {
    const Vector origin = Earlier();
    const Vector u = (Earlier() - origin) / 4;
    const Vector v = (Earlier() - origin) / 3;
    const size_t rows = in_.Below(8);
    const size_t columns = in_.Below(8);
    for (size_t i = 0; i <= rows; ++i) {
      for (size_t j = 0; j <= columns; ++j) {
        Add(origin + static_cast<double>(i) * u + static_cast<double>(j) * v);
      }
    }
  }
  void AddScatter() {
    Scatter scatter(in_.Byte());
    const int range = 1 + static_cast<int>(in_.Below(64));
    const double scale = Power();
    const size_t n = 2 * in_.Below(128);
    const Vector origin = Earlier();
    for (size_t i = 0; i < n; ++i) {
      const double x = scatter.Between(-range, range);
      const double y = scatter.Between(-range, range);
      Add(origin + scale * Vector(x, y, scatter.Between(-range, range)));
    }
  }
  // All points are extreme; many groups of four are coplanar.
  void AddParaboloid() {
    Scatter scatter(in_.Byte());
    const int range = 1 + static_cast<int>(in_.Below(24));
    const double scale = Power();
    const size_t n = 2 * in_.Below(128);
    const Vector origin = Earlier();
    for (size_t i = 0; i < n; ++i) {
      const double x = scatter.Between(-range, range);
      const double y = scatter.Between(-range, range);
      Add(origin + scale * Vector(x, y, x * x + y * y));
    }
  }
  void AddFarAlongAxis() {
    Vector p = Earlier();
    const size_t k = in_.Below(3);
    p[static_cast<int>(k)] = SignedMultiple();
    Add(p);
  }

  double SignedMultiple() {
    const double factor = in_.SignedByte();
    return factor * Power();
  }
  // Returns a power of two within the program's magnitudes.
  double Power() {
    if (magnitudes_ == Magnitudes::kAny) return in_.PowerOfTwo();
    return magnitudes_ == Magnitudes::kCommon ? common_power_ : 1;
  }

  ByteReader in_;
  FuzzCloud cloud_;
  Magnitudes magnitudes_ = Magnitudes::kTame;
  double common_power_ = 1;
};

}  // namespace

FuzzCloud DecodeFuzzCloud(std::span<const uint8_t> bytes) { return Decoder(bytes).Run(); }

}  // namespace hulld::fuzz
