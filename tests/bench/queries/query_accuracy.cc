// Counts wrong answers on the accuracy suite (accuracy_suite.h), by library and kind of query,
// against the exact oracle of the tests, as CSV on standard output:
//
//   query_accuracy > accuracy.csv

#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "tests/bench/queries/accuracy_suite.h"
#include "tests/bench/queries/exact_truth.h"
#include "tests/bench/queries/query_method.h"

namespace hulld::bench {
namespace {

int Main() {
  const AccuracySuite suite = MakeAccuracySuite();
  std::vector<Verdict> truth;
  for (const QuerySet::Query& query : suite.queries) {
    truth.push_back(OracleVerdict(suite.hulls, query));
  }
  std::vector<std::string> kinds;
  for (const std::string& kind : suite.kinds) {
    const std::string name = kind.substr(0, kind.find(','));
    if (std::find(kinds.begin(), kinds.end(), name) == kinds.end()) kinds.push_back(name);
  }

  std::vector<std::unique_ptr<QueryMethod>> methods;
  methods.push_back(MakeHulld());
  methods.push_back(MakeTextbookInDouble());
  methods.push_back(MakeTextbookInDouble(1e-9));
  methods.push_back(MakePlainGjkInDouble());
  methods.push_back(MakePlainGjkInFloat());
  for (std::unique_ptr<QueryMethod>& peer : MakePeers()) methods.push_back(std::move(peer));

  std::cout << "library,queries,wrong,open,missed_collisions,invented_collisions";
  for (const std::string& kind : kinds) std::cout << "," << kind;
  std::cout << "\n";
  for (const std::unique_ptr<QueryMethod>& method : methods) {
    std::vector<Verdict> verdicts(truth.size(), Verdict::kOpen);
    method->Prepare(suite.hulls, suite.queries);
    method->Answer(0, verdicts);
    size_t open = 0;
    size_t missed = 0;
    size_t invented = 0;
    std::vector<size_t> wrong(kinds.size());
    for (size_t i = 0; i < truth.size(); ++i) {
      if (verdicts[i] == truth[i]) continue;
      if (verdicts[i] == Verdict::kOpen) {
        ++open;
        continue;
      }
      ++(truth[i] == Verdict::kColliding ? missed : invented);
      for (size_t k = 0; k < kinds.size(); ++k) {
        wrong[k] += suite.kinds[i].starts_with(kinds[k]) ? 1 : 0;
      }
    }
    std::cout << method->name() << "," << truth.size() << "," << missed + invented << "," << open
              << "," << missed << "," << invented;
    for (const size_t count : wrong) std::cout << "," << count;
    std::cout << std::endl;
  }
  return 0;
}

}  // namespace
}  // namespace hulld::bench

int main() { return hulld::bench::Main(); }
