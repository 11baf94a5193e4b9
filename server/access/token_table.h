#ifndef HULLD_SERVER_ACCESS_TOKEN_TABLE_H_
#define HULLD_SERVER_ACCESS_TOKEN_TABLE_H_

#include <absl/status/statusor.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/access/caller.h"

namespace hulld::server {

// The callers of --tokens-file, by the hashes of their tokens. The file holds one token a line:
//
//   # name      role        prefix   hash
//   camera-1    read-write  cell-1/
//   sha256:9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08 dashboard   read-only
//   *        sha256:60303ae22b998861bce3b28f33eec1be758a213c86c93c076dbe9f558c11c752
//
// name: letters, digits, ".", "_" and "-", 64 at most, unique. role: read-only, read-write or
// admin. prefix: what the IDs that it sees start with, ending in "/"; "*" for all. hash: SHA-256 of
// the token, 64 hexadecimal digits. Blank lines and lines that start with "#" say nothing.
//
// A plain hash guards only what nobody can guess: tokens are 256 random bits (hullctl token new).
class TokenTable {
 public:
  // INVALID_ARGUMENT names the line; it never quotes a hash.
  static absl::StatusOr<TokenTable> Parse(const std::string& text);

  // Whose token this is. The time does not depend on how much of a hash is right.
  std::optional<Caller> Find(const std::string& token) const;

  // Whether a token still makes its owner this caller. Cost: O(tokens), some nanoseconds each.
  bool Knows(const Caller& caller) const;

  size_t size() const { return entries_.size(); }

  bool operator==(const TokenTable&) const = default;

 private:
  using Hash = std::array<uint8_t, 32>;
  struct Entry {
    Hash hash;
    Caller caller;

    bool operator==(const Entry&) const = default;
  };

  absl::Status AddLine(const std::string& line);

  std::vector<Entry> entries_;
};

// Reads --tokens-file. INVALID_ARGUMENT: as ReadSecretFile and TokenTable::Parse.
absl::StatusOr<TokenTable> ReadTokensFile(const std::string& path);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TOKEN_TABLE_H_
