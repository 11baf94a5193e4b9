#ifndef HULLD_CLIENT_HULLCTL_PAIRS_TRADE_PLOT_H_
#define HULLD_CLIENT_HULLCTL_PAIRS_TRADE_PLOT_H_

#include <absl/status/status.h>

#include <string>
#include <vector>

namespace hulld {

// Mean time of an answer, and the largest error of a distance or depth.
struct TradePoint {
  double microseconds = 0;
  double error = 0;
};

// A program compared with the server at several accuracies.
struct TradePlot {
  // Microseconds of each answer of the program; not empty.
  std::vector<double> times;
  double error = 0;
  // Share of wrong answers.
  double wrong = 0;
  std::vector<TradePoint> server;
};

// Draws the plot with gnuplot, on logarithmic axes, as SVG. NOT_FOUND: gnuplot is not installed.
// INTERNAL: it failed. INVALID_ARGUMENT: the file cannot be written.
absl::Status WriteTradePlot(const TradePlot& plot, const std::string& path);

}  // namespace hulld

#endif  // HULLD_CLIENT_HULLCTL_PAIRS_TRADE_PLOT_H_
