// Three panels in a row, a legend below. Horizontal: time per query, logarithmic. Vertical: errors,
// logarithmic, with a band at the bottom for zero, which stacks overlapping marks.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>

#include "tests/bench/trade/trade.h"

namespace hulld::bench {
namespace {

constexpr double kPanelWidth = 330;
constexpr double kPanelHeight = 280;
constexpr double kBandHeight = 150;
constexpr double kTop = 64;
constexpr double kLeft = 78;
constexpr double kPanelStep = 428;
constexpr double kLegendTop = kTop + kPanelHeight + kBandHeight + 78;
constexpr double kLegendLine = 22;
constexpr int kLegendColumns = 4;
constexpr double kMarkRadius = 8;
constexpr double kWidth = kLeft + 2 * kPanelStep + kPanelWidth + 24;

// After Okabe and Ito 2008, Color Universal Design.
const char* ColorOf(TradeFamily family) {
  switch (family) {
    case TradeFamily::kHulld:
      return "#0072B2";
    case TradeFamily::kTolerance:
      return "#56B4E9";
    case TradeFamily::kSimplified:
      return "#009E73";
    case TradeFamily::kTextbook:
      return "#E69F00";
    case TradeFamily::kPlainGjk:
      return "#CC79A7";
    case TradeFamily::kPeer:
      break;
  }
  return "#555555";
}

std::string Number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.1f", value);
  return text;
}

std::string Escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<') {
      result += "&lt;";
    } else if (c == '&') {
      result += "&amp;";
    } else {
      result += c;
    }
  }
  return result;
}

void Text(std::ostream& out, double x, double y, const std::string& text,
          const std::string& attributes = "") {
  out << "<text x=\"" << Number(x) << "\" y=\"" << Number(y) << "\" " << attributes << ">"
      << Escaped(text) << "</text>\n";
}

void Line(std::ostream& out, double x1, double y1, double x2, double y2, const char* color) {
  out << "<line x1=\"" << Number(x1) << "\" y1=\"" << Number(y1) << "\" x2=\"" << Number(x2)
      << "\" y2=\"" << Number(y2) << "\" stroke=\"" << color << "\"/>\n";
}

// Returns "10" and its exponent, raised.
std::string PowerOfTen(int exponent) {
  return "10<tspan dy=\"-5\" font-size=\"9\">" + std::to_string(exponent) + "</tspan>";
}

void PowerText(std::ostream& out, double x, double y, int exponent, const char* anchor) {
  out << "<text x=\"" << Number(x) << "\" y=\"" << Number(y) << "\" text-anchor=\"" << anchor
      << "\">" << PowerOfTen(exponent) << "</text>\n";
}

struct Mark {
  int number;
  TradeFamily family;
  double nanoseconds;
  double wrong;  // 0: in the band
  bool hollow;   // leaves queries open
};

struct Panel {
  std::string title;
  std::string vertical;
  std::string none;
  int lowest_exponent;
  int highest_exponent;
  std::function<std::string(int)> tick;  // empty: the power of ten
  std::vector<Mark> marks;
};

class PanelDrawing {
 public:
  PanelDrawing(const Panel& panel, double left, std::ostream& out)
      : panel_(panel), left_(left), out_(out) {
    double least = 1e300;
    double most = 0;
    for (const Mark& mark : panel.marks) {
      least = std::min(least, mark.nanoseconds);
      most = std::max(most, mark.nanoseconds);
    }
    if (panel.marks.empty()) least = most = 100;
    // Margin for the marks next to the frame.
    constexpr double kRoom = 1.25;
    low_ = static_cast<int>(std::floor(std::log10(least / kRoom)));
    high_ = std::max(low_ + 1, static_cast<int>(std::ceil(std::log10(most * kRoom))));
  }

  void Draw() {
    DrawFrame();
    for (const TradeFamily family : {TradeFamily::kTolerance, TradeFamily::kSimplified}) {
      DrawFamilyLine(family);
    }
    for (const Mark& mark : panel_.marks) DrawMark(mark);
  }

 private:
  double X(double nanoseconds) const {
    return left_ + kPanelWidth * (std::log10(nanoseconds) - low_) / (high_ - low_);
  }
  double Y(double wrong) const {
    const double decades = panel_.highest_exponent - panel_.lowest_exponent;
    const double along = (std::log10(wrong) - panel_.lowest_exponent) / decades;
    return kTop + kPanelHeight * (1 - std::clamp(along, 0.0, 1.0));
  }

  void DrawFrame() {
    constexpr const char* kGrid = "#DDDDDD";
    const double bottom = kTop + kPanelHeight + kBandHeight;
    Text(out_, left_, kTop - 30, panel_.title, "font-size=\"15\" font-weight=\"bold\"");
    Text(out_, left_, kTop - 11, panel_.vertical, "fill=\"#333333\"");
    out_ << "<rect x=\"" << Number(left_) << "\" y=\"" << Number(kTop + kPanelHeight)
         << "\" width=\"" << Number(kPanelWidth) << "\" height=\"" << Number(kBandHeight)
         << "\" fill=\"#EEF6EE\"/>\n";
    for (int exponent = low_; exponent <= high_; ++exponent) {
      const double x = X(std::pow(10, exponent));
      Line(out_, x, kTop, x, bottom, kGrid);
      PowerText(out_, x, bottom + 18, exponent, "middle");
    }
    const int step = panel_.highest_exponent - panel_.lowest_exponent > 6 ? 2 : 1;
    for (int exponent = panel_.lowest_exponent; exponent <= panel_.highest_exponent;
         exponent += step) {
      const double y = Y(std::pow(10, exponent));
      Line(out_, left_, y, left_ + kPanelWidth, y, kGrid);
      if (panel_.tick) {
        Text(out_, left_ - 8, y + 4, panel_.tick(exponent), "text-anchor=\"end\"");
      } else {
        PowerText(out_, left_ - 8, y + 4, exponent, "end");
      }
    }
    Text(out_, left_ - 8, kTop + kPanelHeight + kBandHeight / 2 + 4, panel_.none,
         "text-anchor=\"end\"");
    out_ << "<rect x=\"" << Number(left_) << "\" y=\"" << Number(kTop) << "\" width=\""
         << Number(kPanelWidth) << "\" height=\"" << Number(kPanelHeight + kBandHeight)
         << "\" fill=\"none\" stroke=\"#333333\"/>\n";
    Text(out_, left_ + kPanelWidth / 2, bottom + 40, "time per query (ns), one thread",
         "text-anchor=\"middle\"");
  }

  // Returns the position of the mark: its place, or the nearest free one.
  std::pair<double, double> PlaceOf(const Mark& mark) {
    const double x = X(mark.nanoseconds);
    const bool in_band = mark.wrong == 0;
    const double start =
        in_band ? kTop + kPanelHeight + kBandHeight - kMarkRadius - 3 : Y(mark.wrong);
    double y = start;
    for (int step = 1; step < 40; ++step) {
      const bool free = std::none_of(placed_.begin(), placed_.end(), [&](const auto& other) {
        return std::hypot(other.first - x, other.second - y) < 2 * kMarkRadius - 1;
      });
      if (free) break;
      // Upwards in the band; elsewhere alternating, so that it stays near.
      const double offset = in_band ? step : (step + 1) / 2 * (step % 2 == 1 ? -1 : 1);
      y = start + (in_band ? -4.0 : 3.0) * offset;
    }
    placed_.emplace_back(x, y);
    return {x, y};
  }

  void DrawFamilyLine(TradeFamily family) {
    std::string points;
    for (const Mark& mark : panel_.marks) {
      if (mark.family != family || mark.wrong == 0) continue;
      points += Number(X(mark.nanoseconds)) + "," + Number(Y(mark.wrong)) + " ";
    }
    if (points.empty()) return;
    out_ << "<polyline points=\"" << points << "\" fill=\"none\" stroke=\"" << ColorOf(family)
         << "\" stroke-width=\"1.5\" stroke-opacity=\"0.6\"/>\n";
  }

  void DrawMark(const Mark& mark) {
    const auto [x, y] = PlaceOf(mark);
    const std::string color = ColorOf(mark.family);
    out_ << "<circle cx=\"" << Number(x) << "\" cy=\"" << Number(y) << "\" r=\"" << kMarkRadius
         << "\" fill=\"" << (mark.hollow ? "white" : color) << "\" stroke=\"" << color
         << "\" stroke-width=\"1.5\"/>\n";
    Text(out_, x, y + 3.5, std::to_string(mark.number),
         std::string("text-anchor=\"middle\" font-size=\"10\" font-weight=\"bold\" fill=\"") +
             (mark.hollow ? color : "white") + "\"");
  }

  const Panel& panel_;
  double left_;
  std::ostream& out_;
  int low_;
  int high_;
  std::vector<std::pair<double, double>> placed_;
};

Panel AnswersPanel(const Trade& trade, std::string title,
                   std::optional<TradeAnswers> TradeRow::*answers) {
  Panel panel{std::move(title),
              "wrong answers (% of queries)",
              "none",
              -1,
              2,
              [](int exponent) {
                return exponent < 0
                           ? std::string("0.1 %")
                           : std::to_string(static_cast<int>(std::pow(10, exponent))) + " %";
              },
              {}};
  int number = 0;
  for (const TradeRow& row : trade.rows) {
    ++number;
    const std::optional<TradeAnswers>& each = row.*answers;
    if (!each) continue;
    const double percent =
        100 * static_cast<double>(each->wrong) / static_cast<double>(each->queries);
    panel.marks.push_back({number, row.family, each->nanoseconds, percent, each->open > 0});
  }
  return panel;
}

Panel DepthPanel(const Trade& trade) {
  Panel panel{"Penetration depth",
              "largest error of the depth, relative to the hulls' radius",
              "0",
              -16,
              1,
              {},
              {}};
  int number = 0;
  for (const TradeRow& row : trade.rows) {
    ++number;
    if (!row.depth) continue;
    panel.marks.push_back(
        {number, row.family, row.depth->nanoseconds, row.depth->largest_error, false});
  }
  return panel;
}

std::string LegendText(const TradeRow& row) {
  std::string text = row.method;
  if (row.near_contact && row.near_contact->open > 0) {
    const double share = 100 * static_cast<double>(row.near_contact->open) /
                         static_cast<double>(row.near_contact->queries);
    text += " (" + std::to_string(static_cast<int>(std::lround(share))) + " % open near contact)";
  }
  return text;
}

}  // namespace

void WriteTradePlot(const Trade& trade, std::ostream& out) {
  const auto rows = static_cast<int>(trade.rows.size());
  const int lines = (rows + kLegendColumns - 1) / kLegendColumns;
  const double height = kLegendTop + lines * kLegendLine + 40;
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << Number(kWidth) << "\" height=\""
      << Number(height) << "\" viewBox=\"0 0 " << Number(kWidth) << " " << Number(height)
      << "\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\">\n"
      << "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  const Panel panels[] = {
      AnswersPanel(trade, "Ordinary queries", &TradeRow::ordinary),
      AnswersPanel(trade, "Near contact (1e-6 and less)", &TradeRow::near_contact),
      DepthPanel(trade)};
  double left = kLeft;
  for (const Panel& panel : panels) {
    // Without depths only two panels remain.
    if (panel.marks.empty()) continue;
    PanelDrawing(panel, left, out).Draw();
    left += kPanelStep;
  }
  const double column = (kWidth - kLeft) / kLegendColumns;
  for (int i = 0; i < rows; ++i) {
    const TradeRow& row = trade.rows[static_cast<size_t>(i)];
    const double x = kLeft - 40 + column * (i / lines);
    const double y = kLegendTop + kLegendLine * (i % lines);
    out << "<circle cx=\"" << Number(x) << "\" cy=\"" << Number(y - 4) << "\" r=\"" << kMarkRadius
        << "\" fill=\"" << ColorOf(row.family) << "\"/>\n";
    Text(out, x, y - 0.5, std::to_string(i + 1),
         "text-anchor=\"middle\" font-size=\"10\" font-weight=\"bold\" fill=\"white\"");
    Text(out, x + 16, y, LegendText(row));
  }
  Text(out, kLeft - 48, height - 14,
       "Hollow marks leave queries open: they answer WITHIN_TOLERANCE. tau, errors of "
       "simplification and of depth are relative to the hulls' mean radius.",
       "fill=\"#333333\"");
  out << "</svg>\n";
}

}  // namespace hulld::bench
