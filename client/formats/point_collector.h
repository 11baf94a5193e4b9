#ifndef HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_
#define HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_

#include <absl/status/status.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace hulld {

// Consecutive points of a file, three coordinates per point, all finite: in `xyz_float` where the
// file's scalars are floats, otherwise in `xyz`; the other is empty.
struct PointBlock {
  std::vector<double> xyz;
  std::vector<float> xyz_float;

  size_t size() const { return (xyz.size() + xyz_float.size()) / 3; }
};

// Takes a block; an error ends the reading and is its result.
using BlockReceiver = std::function<absl::Status(PointBlock block)>;

struct ReadOptions {
  // Points per block, the last of a file excepted. 0: about 1 MiB of coordinates.
  size_t points_per_block = 0;
  // Points with a coordinate that is NaN or infinite are counted and left out. Otherwise the first
  // one is an error.
  bool skip_nonfinite = false;
};

struct ReadCounts {
  uint64_t points = 0;
  uint64_t skipped = 0;
};

// Gathers the points that a reader finds into blocks, and applies the rule for points that are not
// finite.
class PointCollector {
 public:
  PointCollector(ReadOptions options, BlockReceiver receive);

  // `error_at` turns a message into an error that names the place, and is called only when there is
  // one.
  template <typename ErrorAt>
  absl::Status Add(double x, double y, double z, const ErrorAt& error_at) {
    return AddTo(&block_.xyz, x, y, z, error_at);
  }
  template <typename ErrorAt>
  absl::Status AddFloat(float x, float y, float z, const ErrorAt& error_at) {
    return AddTo(&block_.xyz_float, x, y, z, error_at);
  }

  // Delivers what is left; called once after the last point of a file.
  absl::Status Flush();

  const ReadCounts& counts() const { return counts_; }

 private:
  template <typename Scalar, typename ErrorAt>
  absl::Status AddTo(std::vector<Scalar>* to, Scalar x, Scalar y, Scalar z,
                     const ErrorAt& error_at) {
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
      ++counts_.skipped;
      if (options_.skip_nonfinite) return absl::OkStatus();
      return error_at(NonFiniteMessage(x, y, z));
    }
    // A block holds one kind of scalar.
    if (to->size() != 3 * block_.size()) {
      if (absl::Status status = Flush(); !status.ok()) return status;
    }
    to->insert(to->end(), {x, y, z});
    ++counts_.points;
    const size_t full = options_.points_per_block != 0 ? options_.points_per_block
                                                       : kBlockBytes / (3 * sizeof(Scalar));
    return 3 * full <= to->size() ? Flush() : absl::OkStatus();
  }

  std::string NonFiniteMessage(double x, double y, double z) const;

  static constexpr size_t kBlockBytes = size_t{1} << 20;

  ReadOptions options_;
  BlockReceiver receive_;
  PointBlock block_;
  ReadCounts counts_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_
