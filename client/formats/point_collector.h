#ifndef HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_
#define HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_

#include <absl/status/status.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "client/formats/length_scale.h"
#include "client/formats/text_number.h"

namespace hulld {

// Consecutive points of a file, n x 3, all finite: in `xyz_float` if the file's scalars are floats,
// otherwise in `xyz`. The other vector is empty.
struct PointChunk {
  std::vector<double> xyz;
  std::vector<float> xyz_float;

  size_t size() const { return (xyz.size() + xyz_float.size()) / 3; }
};

// Receives a block. An error ends the reading and is its result.
using BlockReceiver = std::function<absl::Status(PointChunk block)>;

struct ReadOptions {
  // Points per block; the last block of a file may be smaller. 0: about 1 MiB of coordinates.
  size_t points_per_block = 0;
  // Counts and skips points with a NaN or infinite coordinate. If false, the first such point is an
  // error.
  bool skip_nonfinite = false;
  // Counts and skips points at exactly (0, 0, 0), which depth cameras write for missing data.
  bool skip_zero = false;
  // Accepts a file without points.
  bool allow_empty = false;
  // Factors of x, y, and z. Scaled coordinates are doubles.
  std::array<LengthScale, 3> scale;
};

struct ReadCounts {
  uint64_t points = 0;
  // Points skipped because a coordinate is not finite.
  uint64_t skipped = 0;
  // Points skipped because all coordinates are 0.
  uint64_t zeros = 0;

  bool is_empty() const { return points + skipped + zeros == 0; }
};

// Collects the points of a reader into blocks, scales them, and skips the points that the options
// exclude.
class PointCollector {
 public:
  PointCollector(ReadOptions options, BlockReceiver receive);

  // `error_at` adds the position to an error message. Called only on an error.
  template <typename ErrorAt>
  absl::Status Add(double x, double y, double z, const ErrorAt& error_at) {
    const bool finite = std::isfinite(x) && std::isfinite(y) && std::isfinite(z);
    if (is_scaled_ && finite) {
      x = options_.scale[0].Apply(x);
      y = options_.scale[1].Apply(y);
      z = options_.scale[2].Apply(z);
      if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
        return error_at("a scaled coordinate exceeds the largest double; use a smaller scale");
      }
    }
    return AddScaled(x, y, z, error_at);
  }
  template <typename ErrorAt>
  absl::Status AddFloat(float x, float y, float z, const ErrorAt& error_at) {
    if (is_scaled_) return Add(x, y, z, error_at);
    return AddTo(&block_.xyz_float, x, y, z, error_at);
  }

  // Parses the text of a coordinate (axis: 0, 1, 2) for AddScaled. Text is scaled before it is
  // rounded.
  NumberText Parse(std::string_view text, size_t axis, double* scaled) const {
    return options_.scale[axis].Parse(text, scaled);
  }
  // Adds a point with coordinates from Parse.
  template <typename ErrorAt>
  absl::Status AddScaled(double x, double y, double z, const ErrorAt& error_at) {
    return AddTo(&block_.xyz, x, y, z, error_at);
  }

  // Delivers the remaining points. Called once, after the last point of a file.
  absl::Status Flush();

  const ReadCounts& counts() const { return counts_; }
  const std::array<LengthScale, 3>& scale() const { return options_.scale; }

 private:
  template <typename Scalar, typename ErrorAt>
  absl::Status AddTo(std::vector<Scalar>* to, Scalar x, Scalar y, Scalar z,
                     const ErrorAt& error_at) {
    if (!std::isfinite(x) || !std::isfinite(y) || !std::isfinite(z)) {
      ++counts_.skipped;
      if (options_.skip_nonfinite) return absl::OkStatus();
      return error_at(NonFiniteMessage(x, y, z));
    }
    if (options_.skip_zero && x == 0 && y == 0 && z == 0) {
      ++counts_.zeros;
      return absl::OkStatus();
    }
    // A block contains one kind of scalar.
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
  bool is_scaled_;
  BlockReceiver receive_;
  PointChunk block_;
  ReadCounts counts_;
};

}  // namespace hulld

#endif  // HULLD_CLIENT_FORMATS_POINT_COLLECTOR_H_
