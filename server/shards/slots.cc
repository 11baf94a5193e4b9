#include "server/shards/slots.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_split.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/access/secret_file.h"
#include "server/contract/status_map.h"

namespace hulld::server {
namespace {

constexpr uint16_t kNoShard = UINT16_MAX;

absl::Status Malformed(size_t line, const std::string& what) {
  return absl::InvalidArgumentError(absl::StrCat("line ", line, ": ", what));
}

std::optional<size_t> ParseSlot(std::string_view text) {
  size_t slot = 0;
  const char* const end = text.data() + text.size();
  const auto [parsed, error] = std::from_chars(text.data(), end, slot);
  if (error != std::errc() || parsed != end || slot >= kSlots) return std::nullopt;
  return slot;
}

// Gives the slots of one line to a shard.
absl::Status TakeSlots(const std::string& text, size_t line, uint16_t shard,
                       const std::vector<size_t>& lines, ShardFile* file) {
  const std::vector<std::string> parts = absl::StrSplit(text, ',');
  for (const std::string& part : parts) {
    const size_t dash = part.find('-');
    const std::optional<size_t> first = ParseSlot(std::string_view(part).substr(0, dash));
    const std::optional<size_t> last =
        dash == std::string::npos ? first : ParseSlot(std::string_view(part).substr(dash + 1));
    if (!first.has_value() || !last.has_value() || *first > *last) {
      return Malformed(line, absl::StrCat("\"", part, "\" is no slot from 0 to ", kSlots - 1,
                                          ", nor a range of them such as 0-511"));
    }
    for (size_t slot = *first; slot <= *last; ++slot) {
      uint16_t& holder = file->shard_of[slot];
      if (holder != kNoShard) {
        return Malformed(line, absl::StrCat("slot ", slot, " is named already, in line ",
                                            lines[holder], "; each has one shard"));
      }
      holder = shard;
    }
  }
  return absl::OkStatus();
}

// Slots that no line names, as text; empty where there are none.
std::string MissingSlots(const ShardFile& file) {
  std::vector<bool> missing(kSlots);
  for (size_t slot = 0; slot < kSlots; ++slot) missing[slot] = file.shard_of[slot] == kNoShard;
  return FormatSlots(missing);
}

}  // namespace

std::string FormatSlots(const std::vector<bool>& slots) {
  std::string text;
  for (size_t slot = 0; slot < slots.size(); ++slot) {
    if (!slots[slot]) continue;
    const size_t first = slot;
    while (slot + 1 < slots.size() && slots[slot + 1]) ++slot;
    absl::StrAppend(&text, text.empty() ? "" : ",", first);
    if (slot > first) absl::StrAppend(&text, "-", slot);
  }
  return text;
}

absl::StatusOr<ShardFile> ParseShardFile(std::string_view text, const std::string& directory) {
  ShardFile file;
  file.shard_of.fill(kNoShard);
  // The line of each shard.
  std::vector<size_t> lines;
  size_t line = 0;
  const std::vector<std::string> rows = absl::StrSplit(std::string(text), '\n');
  for (const std::string& whole : rows) {
    ++line;
    const std::string row(absl::StripAsciiWhitespace(whole.substr(0, whole.find('#'))));
    if (row.empty()) continue;
    const size_t space = row.find_first_of(" \t");
    if (space == std::string::npos) {
      return Malformed(line, "it is SLOTS CONNINFO_FILE, as in \"0-511 /etc/hulld/a.conninfo\"");
    }
    const std::string path(absl::StripAsciiWhitespace(row.substr(space)));
    lines.push_back(line);
    const auto shard = static_cast<uint16_t>(file.shards.size());
    if (absl::Status s = TakeSlots(row.substr(0, space), line, shard, lines, &file); !s.ok()) {
      return s;
    }
    file.shards.push_back({"", (std::filesystem::path(directory) / path).string()});
    const auto is_same = [&](const ShardFile::Shard& other) {
      return other.conninfo_file == file.shards.back().conninfo_file;
    };
    const auto first = std::ranges::find_if(file.shards, is_same);
    if (first != std::prev(file.shards.end())) {
      return Malformed(line, absl::StrCat(path, " is named already, in line ",
                                          lines[static_cast<size_t>(first - file.shards.begin())],
                                          "; give all slots of a database in one line"));
    }
  }
  if (file.shards.empty()) return absl::InvalidArgumentError("it names no shard");
  if (const std::string missing = MissingSlots(file); !missing.empty()) {
    return absl::InvalidArgumentError(absl::StrCat(
        "no line names slot ", missing, "; each slot from 0 to ", kSlots - 1, " has one shard"));
  }
  for (size_t shard = 0; shard < file.shards.size(); ++shard) {
    std::vector<bool> slots(kSlots);
    for (size_t slot = 0; slot < kSlots; ++slot) slots[slot] = file.shard_of[slot] == shard;
    file.shards[shard].slots = FormatSlots(slots);
  }
  return file;
}

absl::StatusOr<ShardFile> ReadShardFile(const std::string& path, const std::string& setting) {
  const absl::StatusOr<std::string> text = ReadSettingFile(path, setting);
  if (!text.ok()) return text.status();
  absl::StatusOr<ShardFile> file =
      ParseShardFile(*text, std::filesystem::path(path).parent_path().string());
  if (!file.ok()) return Prefixed(absl::StrCat(setting, " ", path, ": "), file.status());
  return file;
}

}  // namespace hulld::server
