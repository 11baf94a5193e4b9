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

// The callers of --tokens-file, by the hashes of their tokens. The file contains one token per
// line:
//
//   # name    role       prefix  hash
//   camera-1  read-write cell-1/ sha256:9f86d081...b0f00a08
//   dashboard read-only  *       sha256:60303ae2...8c11c752
//
// name: at most 64 letters, digits, ".", "_", and "-"; unique. role: read-only, read-write or
// admin. prefix: the prefix of all visible IDs, ending in "/"; "*" for all IDs. hash: SHA-256 of
// the token, 64 hexadecimal digits. Blank lines and lines that start with "#" are ignored.
//
// A plain hash protects only secrets of high entropy: tokens are 256 random bits (hullctl token
// new).
class TokenTable {
 public:
  // Parses the text of a file. Text without a token results in an empty table. INVALID_ARGUMENT
  // names the line; it never quotes a hash.
  static absl::StatusOr<TokenTable> Parse(const std::string& text);

  // Returns the owner of the token, if any. The duration does not reveal how much of a hash
  // matches.
  std::optional<Caller> Find(const std::string& token) const;

  // Returns true if a token identifies this caller, with the same rights. Cost: O(tokens), a few
  // nanoseconds each.
  bool Knows(const Caller& caller) const;

  size_t size() const { return entries_.size(); }
  bool empty() const { return entries_.empty(); }

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

// Reads --tokens-file. may_be_empty: a missing file or one without a token results in an empty
// table, as the last token may have been revoked. INVALID_ARGUMENT: see ReadSecretFile and
// TokenTable::Parse; or the file contains no token although it may not be empty.
absl::StatusOr<TokenTable> ReadTokensFile(const std::string& path, bool may_be_empty = false);

}  // namespace hulld::server

#endif  // HULLD_SERVER_ACCESS_TOKEN_TABLE_H_
