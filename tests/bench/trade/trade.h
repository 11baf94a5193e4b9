#ifndef HULLD_TESTS_BENCH_TRADE_TRADE_H_
#define HULLD_TESTS_BENCH_TRADE_TRADE_H_

#include <cstddef>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/bench/queries/query_method.h"
#include "tests/bench/trade/trade_questions.h"

namespace hulld::bench {

// Methods that are variations of one, by a parameter.
enum class TradeFamily { kHulld, kTolerance, kSimplified, kTextbook, kPlainGjk, kPeer };

struct TradeMethod {
  TradeFamily family;
  std::unique_ptr<QueryMethod> method;
};

// All that this program knows. Lengths (tolerances, errors) are `size` times what the names say.
std::vector<TradeMethod> MakeTradeMethods(double size);

// How a method answered one range of questions. Absent where it would have taken too long.
struct TradeAnswers {
  double nanoseconds = 0;  // per question, median of the rounds, processor time
  size_t questions = 0;
  size_t wrong = 0;
  size_t open = 0;
};
struct TradeDepths {
  double nanoseconds = 0;
  size_t questions = 0;
  size_t none = 0;  // no depth was found, though the hulls overlap
  // Errors of the depths that were found, relative to TradeQuestions::size.
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
  // A method whose first round would take longer than this on one range is left out there.
  double max_seconds = 10;
};

struct Trade {
  std::vector<TradeRow> rows;
  // What is counted as right is hulld's exact relation. `checked` questions were also asked of the
  // tests' oracle, where it is built in and can answer in reasonable time; it differed `differing`
  // times.
  size_t questions = 0;
  size_t checked = 0;
  size_t differing = 0;
};

// Asks every method every question, the methods in turn in each round.
Trade MeasureTrade(const TradeQuestions& questions, std::vector<TradeMethod>& methods,
                   const TradeSettings& settings);

void WriteTradeTable(const Trade& trade, std::ostream& out);
void WriteTradeCsv(const Trade& trade, std::ostream& out);
// As SVG: time against wrong answers and against the error of the depth.
void WriteTradePlot(const Trade& trade, std::ostream& out);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_TRADE_TRADE_H_
