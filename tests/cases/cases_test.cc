#include "tests/cases/cases.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string>
#include <vector>

#include "client/client.h"
#include "client/verify/answer_check.h"
#include "tests/server/harness/test_server.h"
#include "tests/source_tree.h"

namespace hulld {
namespace cases_test {

using ::testing::EndsWith;
using ::testing::SizeIs;

v1::Placement PlacementOf(const std::vector<double>& points,
                          const std::array<double, 4>& rotation) {
  v1::Placement placement;
  placement.mutable_points()->mutable_xyz()->Assign(points.begin(), points.end());
  v1::Quaternion& quaternion = *placement.mutable_pose()->mutable_rotation();
  quaternion.set_w(rotation[0]);
  quaternion.set_x(rotation[1]);
  quaternion.set_y(rotation[2]);
  quaternion.set_z(rotation[3]);
  placement.mutable_pose()->mutable_translation();
  return placement;
}

class CasesThatOthersGotWrong : public server::ServerTest {
 protected:
  // Expects the answer of the case, and that its certificate proves it.
  void ExpectAnswer(const Case& one, const v1::Placement& a, const v1::Placement& b) const {
    ClientOptions options;
    options.server = server_->address();
    v1::CheckCollisionRequest request;
    *request.mutable_a() = a;
    *request.mutable_b() = b;
    request.mutable_wanted()->set_separation(true);
    request.mutable_wanted()->set_certificate(true);
    request.mutable_wanted()->set_analysis(true);
    const auto answer = CheckCollisionVerified(Client(options), request);
    ASSERT_TRUE(answer.ok()) << one.report << ": " << answer.status();
    EXPECT_EQ(answer->verification.verdict, Verdict::kValid)
        << one.report << ": " << answer->verification.reason;
    const v1::CheckCollisionResponse& response = answer->response;
    EXPECT_EQ(response.relation(), one.relation) << one.report;
    if (!std::isnan(one.separation)) {
      EXPECT_LE(std::abs(response.separation().value() - one.separation),
                response.separation().bound() + one.rounding)
          << one.report << ": " << response.separation().value();
    }
    const bool is_a = a.points().xyz_size() == static_cast<int>(one.a.size());
    if (one.vertices > 0 && is_a) {
      EXPECT_EQ(response.analysis().size_a().vertices(), one.vertices) << one.report;
    }
  }
};

TEST_F(CasesThatOthersGotWrong, AreAnsweredExactlyAndProven) {
  for (const Case& one : ReportedCases()) {
    const v1::Placement a = PlacementOf(one.a, one.rotation);
    const v1::Placement b = PlacementOf(one.b, one.rotation);
    ExpectAnswer(one, a, b);
    ExpectAnswer(one, b, a);
  }
}

// The cells of the page that the case determines: the link of its report, and the answer.
struct Cells {
  std::string link;
  std::string answer;
};

Cells CellsOf(const Case& one) {
  const size_t slash = one.report.find('/');
  const size_t mark = one.report.find('#');
  const std::string name = one.report.substr(slash + 1);
  const std::string repository = one.report.substr(0, mark);
  const std::string number = one.report.substr(mark + 1);
  std::string answer = v1::Relation_Name(one.relation).substr(sizeof("RELATION_") - 1);
  if (!std::isnan(one.separation)) absl::StrAppend(&answer, ", ", one.separation);
  return {absl::StrCat("| [", name, "](https://github.com/", repository, "/issues/", number, ") |"),
          absl::StrCat("| ", answer, " |")};
}

// Each row of the page is a case, and the other way around.
TEST(PageOfCases, ListsEachCaseWithItsAnswer) {
  std::ifstream page(SourceTree() / "tests/cases/README.md");
  std::vector<std::string> rows;
  for (std::string line; std::getline(page, line);) {
    // GitHub redirects an issue's address to a pull request of the same number.
    if (line.starts_with("| ["))
      rows.push_back(absl::StrReplaceAll(line, {{"/pull/", "/issues/"}}));
  }
  const std::vector<Case> cases = ReportedCases();
  EXPECT_THAT(rows, SizeIs(cases.size()));
  for (const Case& one : cases) {
    const Cells cells = CellsOf(one);
    const auto row = std::find_if(rows.begin(), rows.end(), [&](const std::string& line) {
      return line.starts_with(cells.link);
    });
    if (row == rows.end()) {
      ADD_FAILURE() << "no row starts with " << cells.link;
    } else {
      EXPECT_THAT(*row, EndsWith(cells.answer));
    }
  }
}

}  // namespace cases_test
}  // namespace hulld
