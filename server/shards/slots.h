#ifndef HULLD_SERVER_SHARDS_SLOTS_H_
#define HULLD_SERVER_SHARDS_SLOTS_H_

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace hulld::server {

// IDs are spread over this many slots, and slots over shards; for good, as the databases remember
// which slots they hold.
inline constexpr size_t kSlots = 1024;

// The slot of a hull or a body: h = FNV-1a with 64 bits of the bytes of its ID (offset basis
// 14695981039346656037, prime 1099511628211), folded: (h xor (h >> 32)) mod 1024. Source: Fowler,
// Noll and Vo, RFC draft-eastlake-fnv, The FNV Non-Cryptographic Hash Algorithm. Cost: some
// nanoseconds for ten bytes.
constexpr size_t SlotOf(std::string_view id) {
  uint64_t hash = 14695981039346656037U;
  for (const char c : id) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211U;
  }
  return (hash ^ (hash >> 32)) % kSlots;
}

// Which slots a shard holds, as text: ranges in ascending order, separated by commas, as
// "0-511,700"; the same text for the same slots.
std::string FormatSlots(const std::vector<bool>& slots);

// The file of --postgres-shards.
struct ShardFile {
  struct Shard {
    // As FormatSlots.
    std::string slots;
    // Absolute, or relative to where the process was started.
    std::string conninfo_file;
  };
  std::vector<Shard> shards;
  // The shard of each slot.
  std::array<uint16_t, kSlots> shard_of{};
};

// Reads text of lines "SLOTS CONNINFO_FILE", one for each shard: slots are numbers from 0 to 1023
// and ranges of them, separated by commas; `#` begins a comment. Relative paths are relative to
// `directory`. INVALID_ARGUMENT, naming the line and the slot: a line that is malformed, a slot
// that is out of range, that two lines have, or that none has; a file that two lines name.
absl::StatusOr<ShardFile> ParseShardFile(std::string_view text, const std::string& directory);
// The same of a file, which `setting` names in errors, as in "--postgres-shards". INVALID_ARGUMENT
// also: it cannot be read.
absl::StatusOr<ShardFile> ReadShardFile(const std::string& path, const std::string& setting);

}  // namespace hulld::server

#endif  // HULLD_SERVER_SHARDS_SLOTS_H_
