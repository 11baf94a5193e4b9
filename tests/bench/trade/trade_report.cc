#include <cstdio>
#include <iomanip>

#include "tests/bench/trade/trade.h"

namespace hulld::bench {
namespace {

std::string Format(const char* format, double value) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string Time(double nanoseconds) {
  if (nanoseconds < 1e3) return Format("%.0f ns", nanoseconds);
  if (nanoseconds < 1e6) return Format("%.1f us", nanoseconds * 1e-3);
  return Format("%.1f ms", nanoseconds * 1e-6);
}

std::string Wrong(const TradeAnswers& answers) {
  std::string text = std::to_string(answers.wrong);
  if (answers.open > 0) text += " (" + std::to_string(answers.open) + " open)";
  return text;
}

void WriteAnswersCsv(const std::optional<TradeAnswers>& answers, std::ostream& out) {
  if (!answers) {
    out << ",,,,";
    return;
  }
  out << "," << answers->nanoseconds << "," << answers->queries << "," << answers->wrong << ","
      << answers->open;
}

}  // namespace

void WriteTradeTable(const Trade& trade, std::ostream& out) {
  const auto line = [&](const std::string& method, const std::string& ordinary,
                        const std::string& ordinary_wrong, const std::string& near,
                        const std::string& near_wrong, const std::string& depth,
                        const std::string& error, const std::string& worst) {
    out << std::left << std::setw(20) << method << std::right << std::setw(10) << ordinary
        << std::setw(15) << ordinary_wrong << std::setw(14) << near << std::setw(15) << near_wrong
        << std::setw(10) << depth << std::setw(12) << error << std::setw(13) << worst << "\n";
  };
  line("", "ordinary", "wrong", "near contact", "wrong", "depth", "error", "worst error");
  for (const TradeRow& row : trade.rows) {
    const std::string none = "-";
    line(row.method, row.ordinary ? Time(row.ordinary->nanoseconds) : none,
         row.ordinary ? Wrong(*row.ordinary) : none,
         row.near_contact ? Time(row.near_contact->nanoseconds) : none,
         row.near_contact ? Wrong(*row.near_contact) : none,
         row.depth ? Time(row.depth->nanoseconds) : none,
         row.depth ? Format("%.0e", row.depth->median_error) : none,
         row.depth ? Format("%.0e", row.depth->largest_error) : none);
  }
  const TradeRow& first = trade.rows.front();
  out << "\nPer query; processor time on one thread, medians. ";
  if (first.ordinary && first.near_contact) {
    out << first.ordinary->queries << " ordinary queries, " << first.near_contact->queries
        << " near contact.\n";
  }
  out << "Lengths (tau, simplified, errors of the depth) are relative to the hulls' mean radius.\n"
      << "The reference is hulld's exact relation; an oracle that shares no code with it answered "
      << trade.checked << " of the " << trade.queries << " queries and differed " << trade.differing
      << " times.\n";
}

void WriteTradeCsv(const Trade& trade, std::ostream& out) {
  out << "method,ordinary_ns,ordinary_queries,ordinary_wrong,ordinary_open,near_contact_ns,"
         "near_contact_queries,near_contact_wrong,near_contact_open,depth_ns,depth_queries,"
         "depth_none,depth_median_relative_error,depth_largest_relative_error\n";
  for (const TradeRow& row : trade.rows) {
    std::string name = row.method;
    if (const size_t comma = name.find(','); comma != std::string::npos) name.erase(comma, 1);
    out << name;
    WriteAnswersCsv(row.ordinary, out);
    WriteAnswersCsv(row.near_contact, out);
    if (row.depth) {
      out << "," << row.depth->nanoseconds << "," << row.depth->queries << "," << row.depth->none
          << "," << row.depth->median_error << "," << row.depth->largest_error << "\n";
    } else {
      out << ",,,,,\n";
    }
  }
}

}  // namespace hulld::bench
