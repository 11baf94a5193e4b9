#ifndef HULLD_TESTS_BENCH_TRADE_TRADE_H_
#define HULLD_TESTS_BENCH_TRADE_TRADE_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/bench/queries/query_method.h"
#include "tests/bench/trade/trade_queries.h"

namespace hulld::bench {

// Families of methods that vary by a parameter.
enum class TradeFamily { kHulld, kTolerance, kSimplified, kTextbook, kPlainGjk, kPeer };

struct TradeMethod {
  TradeFamily family;
  std::unique_ptr<QueryMethod> method;
};

// Returns all methods known to this program. Lengths (tolerances, errors) are `size` times the
// factor in the name.
std::vector<TradeMethod> MakeTradeMethods(double size);

// Answers of a method on one range of queries. Absent if it would have taken too long.
struct TradeAnswers {
  double nanoseconds = 0;  // per query, median of the rounds, processor time
  size_t queries = 0;
  size_t wrong = 0;
  size_t open = 0;
};
struct TradeDepths {
  double nanoseconds = 0;
  size_t queries = 0;
  size_t none = 0;  // no depth was found, though the hulls overlap
  // Errors of the depths found, relative to TradeQueries::size.
  double median_error = 0;
  double largest_error = 0;
};
struct TradeRow {
  std::string method;
  TradeFamily family;
  std::optional<TradeAnswers> ordinary;
  std::optional<TradeAnswers> near_contact;
  std::optional<TradeDepths> depth;
};

struct TradeSettings {
  int rounds = 5;
  // A method is omitted from a range if its first round would take longer than this.
  double max_seconds = 10;
};

struct Trade {
  std::vector<TradeRow> rows;
  // hulld's exact relation is the reference. `checked` queries also ran against the tests' oracle,
  // if built in and fast enough; it differed `differing` times.
  size_t queries = 0;
  size_t checked = 0;
  size_t differing = 0;
};

// Runs every query with every method, alternating the methods in each round.
Trade MeasureTrade(const TradeQueries& queries, std::vector<TradeMethod>& methods,
                   const TradeSettings& settings);

void WriteTradeTable(const Trade& trade, std::ostream& out);
void WriteTradeCsv(const Trade& trade, std::ostream& out);
// As SVG: time against wrong answers and against the error of the depth.
void WriteTradePlot(const Trade& trade, std::ostream& out);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_TRADE_TRADE_H_
