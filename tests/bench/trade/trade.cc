#include "tests/bench/trade/trade.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "core/query/collision.h"
#ifdef HULLD_HAVE_ORACLE
#include "tests/bench/queries/exact_truth.h"
#endif

namespace hulld::bench {
namespace {

double ThreadSeconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// One method on one range of queries: its answers, and their time.
template <typename Value>
class Measurement {
 public:
  using Query = void (QueryMethod::*)(size_t first, std::span<Value> values);

  Measurement(QueryMethod* method, Query query, TradeQueries::Range range)
      : method_(method), query_(query), range_(range), values_(range.count) {}

  const std::vector<Value>& values() const { return values_; }
  bool too_slow() const { return too_slow_; }
  double nanoseconds() const { return 1e9 * Median(seconds_) / static_cast<double>(range_.count); }

  // Runs query by query, so that it can stop early. Then runs all again and measures that: some
  // methods prepare data on the first query.
  void RunFirst(double max_seconds) {
    const double start = ThreadSeconds();
    for (size_t i = 0; i < range_.count && !too_slow_; ++i) {
      (method_->*query_)(range_.first + i, std::span(values_).subspan(i, 1));
      too_slow_ = ThreadSeconds() - start > max_seconds;
    }
    if (too_slow_) return;
    const double start_again = ThreadSeconds();
    (method_->*query_)(range_.first, values_);
    constexpr double kShortestRun = 2e-3;
    const double once = std::max(ThreadSeconds() - start_again, 1e-7);
    repetitions_ = std::clamp(static_cast<int>(kShortestRun / once), 1, 1000);
  }

  void Run() {
    if (too_slow_) return;
    const double start = ThreadSeconds();
    for (int i = 0; i < repetitions_; ++i) (method_->*query_)(range_.first, values_);
    seconds_.push_back((ThreadSeconds() - start) / repetitions_);
  }

 private:
  QueryMethod* method_;
  Query query_;
  TradeQueries::Range range_;
  std::vector<Value> values_;
  bool too_slow_ = false;
  int repetitions_ = 1;
  std::vector<double> seconds_;
};

using VerdictMeasurement = Measurement<Verdict>;
using DepthMeasurement = Measurement<std::optional<double>>;

struct Measured {
  VerdictMeasurement ordinary;
  VerdictMeasurement near_contact;
  std::optional<DepthMeasurement> depth;
};

std::optional<TradeAnswers> Summarize(const VerdictMeasurement& measured,
                                      std::span<const Verdict> truth) {
  if (measured.too_slow()) return std::nullopt;
  TradeAnswers answers;
  answers.nanoseconds = measured.nanoseconds();
  answers.queries = truth.size();
  for (size_t i = 0; i < truth.size(); ++i) {
    if (measured.values()[i] == Verdict::kOpen) {
      ++answers.open;
    } else if (measured.values()[i] != truth[i]) {
      ++answers.wrong;
    }
  }
  return answers;
}

std::optional<TradeDepths> Summarize(const std::optional<DepthMeasurement>& measured,
                                     const std::vector<std::optional<double>>& truth, double size) {
  if (!measured || measured->too_slow()) return std::nullopt;
  TradeDepths depths;
  depths.nanoseconds = measured->nanoseconds();
  std::vector<double> errors;
  for (size_t i = 0; i < truth.size(); ++i) {
    if (!truth[i]) continue;
    ++depths.queries;
    if (const std::optional<double> depth = measured->values()[i]) {
      errors.push_back(std::abs(*depth - *truth[i]) / size);
    } else {
      ++depths.none;
    }
  }
  // The method finds no depth at all.
  if (errors.empty()) return std::nullopt;
  depths.median_error = Median(errors);
  depths.largest_error = *std::max_element(errors.begin(), errors.end());
  return depths;
}

std::vector<Verdict> ExactVerdicts(const TradeQueries& queries) {
  const std::unique_ptr<QueryMethod> exact = MakeHulld();
  exact->Prepare(queries.hulls, queries.queries);
  std::vector<Verdict> verdicts(queries.queries.size());
  exact->Answer(0, verdicts);
  return verdicts;
}

// nullopt if the hulls are apart.
std::vector<std::optional<double>> BestDepths(const TradeQueries& queries) {
  std::vector<std::optional<double>> depths;
  for (size_t i = 0; i < queries.depth.count; ++i) {
    const QuerySet::Query& query = queries.queries[queries.depth.first + i];
    const double separation = BestSeparation(queries.hulls[query.hull_a], query.X_WA,
                                             queries.hulls[query.hull_b], query.X_WB);
    depths.emplace_back();
    if (separation <= 0) depths.back() = -separation;
  }
  return depths;
}

void CheckByOracle([[maybe_unused]] const TradeQueries& queries,
                   [[maybe_unused]] std::span<const Verdict> truth, [[maybe_unused]] Trade& trade) {
#ifdef HULLD_HAVE_ORACLE
  constexpr size_t kMaxVertices = 200;
  constexpr double kMaxSeconds = 60;
  const double start = ThreadSeconds();
  for (size_t i = 0; i < truth.size() && ThreadSeconds() - start < kMaxSeconds; ++i) {
    const QuerySet::Query& query = queries.queries[i];
    if (queries.hulls[query.hull_a].vertices().size() > kMaxVertices) continue;
    if (queries.hulls[query.hull_b].vertices().size() > kMaxVertices) continue;
    ++trade.checked;
    trade.differing += OracleVerdict(queries.hulls, query) != truth[i] ? 1 : 0;
  }
#endif
}

std::string WithParameter(const char* name, double value) {
  char text[64];
  std::snprintf(text, sizeof text, "%s %.0e", name, value);
  return text;
}

}  // namespace

std::vector<TradeMethod> MakeTradeMethods(double size) {
  constexpr double kPerturbation = 1e-9;
  std::vector<TradeMethod> methods;
  methods.push_back({TradeFamily::kHulld, MakeHulld()});
  for (const double tolerance : {1e-12, 1e-9, 1e-6, 1e-3, 1e-1}) {
    methods.push_back({TradeFamily::kTolerance,
                       MakeHulldWithin(tolerance * size, WithParameter("hulld, tau", tolerance))});
  }
  for (const double error : {1e-3, 1e-2, 5e-2, 2e-1}) {
    methods.push_back({TradeFamily::kSimplified,
                       MakeHulldSimplified(error * size, WithParameter("simplified", error))});
  }
  methods.push_back({TradeFamily::kTextbook, MakeTextbookInDouble()});
  methods.push_back({TradeFamily::kTextbook, MakeTextbookInDouble(kPerturbation)});
  methods.push_back({TradeFamily::kPlainGjk, MakePlainGjkInDouble()});
  methods.push_back({TradeFamily::kPlainGjk, MakePlainGjkInFloat()});
  for (std::unique_ptr<QueryMethod>& peer : MakePeers()) {
    methods.push_back({TradeFamily::kPeer, std::move(peer)});
  }
  return methods;
}

Trade MeasureTrade(const TradeQueries& queries, std::vector<TradeMethod>& methods,
                   const TradeSettings& settings) {
  Trade trade;
  const std::vector<Verdict> truth = ExactVerdicts(queries);
  const std::vector<std::optional<double>> depths = BestDepths(queries);
  trade.queries = truth.size();
  CheckByOracle(queries, truth, trade);

  std::vector<Measured> measured;
  for (const TradeMethod& each : methods) {
    QueryMethod* method = each.method.get();
    method->Prepare(queries.hulls, queries.queries);
    measured.push_back({{method, &QueryMethod::Answer, queries.ordinary},
                        {method, &QueryMethod::Answer, queries.near_contact},
                        {}});
    Measured& last = measured.back();
    if (method->knows_depth()) {
      last.depth.emplace(method, &QueryMethod::MeasureDepths, queries.depth);
      last.depth->RunFirst(settings.max_seconds);
    }
    last.ordinary.RunFirst(settings.max_seconds);
    last.near_contact.RunFirst(settings.max_seconds);
  }
  for (int round = 0; round < settings.rounds; ++round) {
    for (Measured& each : measured) {
      each.ordinary.Run();
      each.near_contact.Run();
      if (each.depth) each.depth->Run();
    }
  }
  for (size_t i = 0; i < methods.size(); ++i) {
    const auto part = [&](TradeQueries::Range range) {
      return std::span(truth).subspan(range.first, range.count);
    };
    trade.rows.push_back({methods[i].method->name(), methods[i].family,
                          Summarize(measured[i].ordinary, part(queries.ordinary)),
                          Summarize(measured[i].near_contact, part(queries.near_contact)),
                          Summarize(measured[i].depth, depths, queries.size)});
  }
  return trade;
}

}  // namespace hulld::bench
