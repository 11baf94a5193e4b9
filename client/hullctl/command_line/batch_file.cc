#include "client/hullctl/command_line/batch_file.h"

#include <absl/strings/str_cat.h>

#include <cmath>
#include <unordered_map>

#include "client/formats/text_number.h"
#include "client/hullctl/command_line/arguments.h"

namespace hulld {
namespace {

class BatchParser {
 public:
  explicit BatchParser(ByteSource* source) : source_(source) {}

  absl::StatusOr<BatchScene> Parse() {
    std::string_view line;
    while (source_->ReadLine(&line)) {
      std::vector<std::string_view> words;
      std::string_view rest = line.substr(0, line.find('#'));
      for (std::string_view word; !(word = NextToken(&rest)).empty();) words.push_back(word);
      if (words.empty()) continue;
      if (absl::Status status = ParseItem(words); !status.ok()) return status;
    }
    if (!source_->status().ok()) return source_->status();
    if (absl::Status status = ResolvePairs(); !status.ok()) return status;
    return std::move(scene_);
  }

 private:
  struct NamedPair {
    std::string a;
    std::string b;
    uint64_t line;
  };

  absl::Status ParseItem(const std::vector<std::string_view>& words) {
    if (words[0] == "place") return ParsePlace(words);
    if (words[0] == "pair") {
      if (words.size() != 3) return source_->ErrorAtLine("a pair is: pair NAME NAME");
      if (pairs_.size() >= kMaxBatchPairs) return TooManyPairs(source_->line());
      pairs_.push_back({std::string(words[1]), std::string(words[2]), source_->line()});
      return absl::OkStatus();
    }
    if (words[0] == "all" && words.size() == 1) {
      all_line_ = source_->line();
      return absl::OkStatus();
    }
    return source_->ErrorAtLine(
        absl::StrCat(Quoted(words[0]), " is no item; items are place, pair and all"));
  }

  absl::Status ParsePlace(const std::vector<std::string_view>& words) {
    if (words.size() < 3) {
      return source_->ErrorAtLine("a placement is: place NAME HULL [[w x y z] tx ty tz]");
    }
    const std::string name(words[1]);
    const uint32_t index = static_cast<uint32_t>(scene_.placements.size());
    if (!index_.emplace(name, index).second) {
      return source_->ErrorAtLine(absl::StrCat("the name ", Quoted(name), " is taken already"));
    }
    v1::Placement placement;
    placement.set_hull_id(std::string(words[2]));
    if (words.size() > 3) {
      std::vector<double> numbers;
      for (size_t i = 3; i < words.size(); ++i) {
        double number = 0;
        const NumberText kind = ParseDouble(words[i], &number);
        if (kind != NumberText::kNumber) return source_->ErrorAtLine(NumberProblem(kind, words[i]));
        if (!std::isfinite(number)) {
          return source_->ErrorAtLine(absl::StrCat(Quoted(words[i]), " is not a finite number"));
        }
        numbers.push_back(number);
      }
      const absl::StatusOr<v1::Pose> pose = PoseFromNumbers(numbers);
      if (!pose.ok()) {
        return source_->ErrorAtLine(
            std::string(pose.status().message().data(), pose.status().message().size()));
      }
      *placement.mutable_pose() = *pose;
    }
    scene_.names.push_back(name);
    scene_.placements.push_back(std::move(placement));
    return absl::OkStatus();
  }

  absl::Status TooManyPairs(uint64_t line) const {
    return absl::InvalidArgumentError(absl::StrCat(source_->name(), ":", line, ": more than ",
                                                   kMaxBatchPairs,
                                                   " pairs; ask for them in several files"));
  }

  absl::Status ResolvePairs() {
    for (const NamedPair& pair : pairs_) {
      const auto a = index_.find(pair.a);
      const auto b = index_.find(pair.b);
      if (a == index_.end() || b == index_.end()) {
        return absl::InvalidArgumentError(absl::StrCat(source_->name(), ":", pair.line, ": ",
                                                       Quoted(a == index_.end() ? pair.a : pair.b),
                                                       " is not placed; add: place NAME HULL"));
      }
      scene_.pairs.emplace_back(a->second, b->second);
    }
    if (all_line_ == 0) return absl::OkStatus();
    const uint64_t n = scene_.placements.size();
    if (n > 0 && scene_.pairs.size() + n * (n - 1) / 2 > kMaxBatchPairs) {
      return TooManyPairs(all_line_);
    }
    for (uint32_t a = 0; a < n; ++a) {
      for (uint32_t b = a + 1; b < n; ++b) scene_.pairs.emplace_back(a, b);
    }
    return absl::OkStatus();
  }

  ByteSource* source_;
  BatchScene scene_;
  std::unordered_map<std::string, uint32_t> index_;
  std::vector<NamedPair> pairs_;
  // The line of `all`; 0 when there is none.
  uint64_t all_line_ = 0;
};

}  // namespace

absl::StatusOr<BatchScene> ReadBatchFile(ByteSource* source) { return BatchParser(source).Parse(); }

}  // namespace hulld
