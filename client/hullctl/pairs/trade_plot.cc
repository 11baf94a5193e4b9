#include "client/hullctl/pairs/trade_plot.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>

namespace hulld {
namespace {

// Zero has no logarithm; it is drawn as the rounding of a double.
constexpr double kMinError = 1e-17;

std::string Row(const TradePoint& point) {
  return absl::StrFormat("%.17g %.17g\n", point.microseconds, std::max(point.error, kMinError));
}

std::string ScriptOf(const TradePlot& plot, const std::string& path) {
  const double mean = std::accumulate(plot.times.begin(), plot.times.end(), 0.0) /
                      static_cast<double>(plot.times.size());
  std::string script = absl::StrCat(
      "set terminal svg size 640,420 font 'Helvetica,13' background 'white'\n"
      "set output '",
      path,
      "'\n"
      "set logscale xy\n"
      "set format xy '10^{%T}'\n"
      "set offsets graph 0.1, graph 0.25, graph 0.1, graph 0.1\n"
      "set xlabel 'microseconds per pair'\n"
      "set ylabel 'largest error of a distance or depth'\n"
      "set grid lt 1 lw 0.6 lc rgb '#d0d7de'\n"
      "set key right top\n"
      "$program <<EOD\n",
      Row({mean, plot.error}), "EOD\n$server <<EOD\n");
  for (const TradePoint& point : plot.server) absl::StrAppend(&script, Row(point));
  return absl::StrCat(
      script,
      "EOD\n"
      "plot $server with linespoints pt 7 lc rgb '#0969da' title 'hulld, proven bound', \\\n"
      "  $program with points pt 7 ps 1.4 lc rgb '#cf222e' title '",
      absl::StrFormat("the program, %.3g%% wrong", 100 * plot.wrong), "'\n");
}

}  // namespace

absl::Status WriteTradePlot(const TradePlot& plot, const std::string& path) {
  if (path.find_first_of("'\n") != std::string::npos || !std::ofstream(path, std::ios::app)) {
    return absl::InvalidArgumentError(absl::StrCat("cannot write ", path));
  }
  if (std::system("command -v gnuplot > /dev/null") != 0) {
    return absl::NotFoundError("--plot needs gnuplot; install it (Debian: gnuplot-nox)");
  }
  FILE* const gnuplot = popen("gnuplot", "w");
  if (gnuplot == nullptr) return absl::InternalError("cannot start gnuplot");
  const std::string script = ScriptOf(plot, path);
  fwrite(script.data(), 1, script.size(), gnuplot);
  const int status = pclose(gnuplot);
  if (status == 0) return absl::OkStatus();
  std::remove(path.c_str());
  return absl::InternalError("gnuplot failed");
}

}  // namespace hulld
