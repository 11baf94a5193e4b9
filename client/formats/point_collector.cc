#include "client/formats/point_collector.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

namespace hulld {

PointCollector::PointCollector(ReadOptions options, BlockReceiver receive)
    : options_(options), receive_(std::move(receive)) {
  is_scaled_ = !std::all_of(options_.scale.begin(), options_.scale.end(),
                            [](const LengthScale& scale) { return scale.is_one(); });
}

absl::Status PointCollector::Flush() {
  if (block_.size() == 0) return absl::OkStatus();
  return receive_(std::exchange(block_, PointChunk()));
}

std::string PointCollector::NonFiniteMessage(double x, double y, double z) const {
  const double xyz[] = {x, y, z};
  int bad = 0;
  while (std::isfinite(xyz[bad])) ++bad;
  return absl::StrCat("point ", counts_.points + counts_.skipped + counts_.zeros, " has ",
                      std::string(1, "xyz"[bad]), " = ", std::isnan(xyz[bad]) ? "NaN" : "infinity",
                      "; skip such points with --skip-nonfinite");
}

}  // namespace hulld
