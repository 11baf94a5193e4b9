#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <openssl/sha.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <iostream>
#include <memory>
#include <string>

#include "client/hullctl/command_line/commands.h"
#include "client/hullctl/printing/json.h"
#include "client/hullctl/printing/table.h"

namespace hulld {
namespace {

struct TokenArguments {
  std::string name;
  std::string role;
  std::string prefix;
  std::string file;
};

// Returns the hash in the form of hulld's token file.
std::string HashText(const std::string& token) {
  std::array<unsigned char, SHA256_DIGEST_LENGTH> hash = {};
  SHA256(reinterpret_cast<const unsigned char*>(token.data()), token.size(), hash.data());
  return absl::StrCat("sha256:", absl::BytesToHexString(absl::string_view(
                                     reinterpret_cast<const char*>(hash.data()), hash.size())));
}

// Returns 256 random bits, so that a plain hash reveals nothing.
absl::StatusOr<std::string> RandomToken() {
  std::array<char, 32> bytes = {};
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    return absl::InternalError("cannot read random bytes from the system");
  }
  return absl::StrCat("hulld_",
                      absl::WebSafeBase64Escape(absl::string_view(bytes.data(), bytes.size())));
}

// Creates a new file, so that no token is overwritten and no other process has it open.
absl::Status WriteTokenFile(const std::string& path, const std::string& token) {
  const int fd = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (fd < 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("--token-out ", path, ": ", std::strerror(errno)));
  }
  const std::string line = token + "\n";
  const bool written = write(fd, line.data(), line.size()) == static_cast<ssize_t>(line.size());
  if (close(fd) == 0 && written) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("--token-out ", path, ": cannot be written"));
}

ExitCode NewToken(const Invocation& run, const TokenArguments& arguments) {
  HULLD_ASSIGN_OR_FAIL(run.FailUsage, const std::string token, RandomToken());
  const std::string line =
      absl::StrCat(arguments.name, " ", arguments.role, " ",
                   arguments.prefix.empty() ? "*" : arguments.prefix, " ", HashText(token));
  if (!arguments.file.empty()) {
    const absl::Status written = WriteTokenFile(arguments.file, token);
    if (!written.ok()) return run.FailUsage(written);
    run.out << line << "\n";
  } else if (run.json()) {
    run.out << JsonObject().Add("token", token).Add("line", line).Close() << "\n";
  } else {
    Table().Row({"token", token}).Row({"line", line}).Print(run.out);
  }
  return ExitCode::kDone;
}

ExitCode HashToken(const Invocation& run) {
  std::string token;
  if (!(std::cin >> token)) {
    return run.FailUsage("standard input contains no token");
  }
  run.out << HashText(token) << "\n";
  return ExitCode::kDone;
}

}  // namespace

void AddTokenCommand(Command program, Invocation* invocation) {
  Command command =
      program.AddCommand("token", "Create a token and its line for hulld's --tokens-file");
  command.RequireCommand();
  const auto arguments = std::make_shared<TokenArguments>();
  Command make = command.AddCommand("new", "Create a random token");
  make.AddText("NAME", &arguments->name, "Owner of the token, shown in the server's messages")
      .Required()
      .Check([](const std::string& name) -> std::string {
        const bool valid = name.size() <= 64 && !name.empty() && std::isalnum(name[0]) != 0 &&
                           name.find_first_not_of(
                               "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz"
                               "0123456789._-") == std::string::npos;
        return valid ? ""
                     : "a name has up to 64 characters of [A-Za-z0-9._-] and starts with a letter "
                       "or digit";
      });
  make.AddText("--role", &arguments->role, "Permissions of the token")
      .ValueName("ROLE")
      .Required()
      .OneOf({"read-only", "read-write", "admin"});
  make.AddText("--prefix", &arguments->prefix,
               "Prefix of the IDs that the token may access, ending in \"/\" (default: all)")
      .ValueName("PREFIX")
      .Check([](const std::string& prefix) -> std::string {
        const bool valid = prefix.size() > 1 && prefix.back() == '/' &&
                           prefix.find_first_of(" \t") == std::string::npos;
        return valid ? "" : "a prefix ends in \"/\", as in cell-1/";
      });
  make.AddText("--token-out", &arguments->file,
               "Write the token to this new file, readable only by you, and print only the line")
      .ValueName("FILE");
  make.SetExamples({{"For a robot that may write under cell-1/",
                     "hullctl token new robot-1 --role read-write --prefix cell-1/ "
                     "--token-out robot-1.token >> tokens"}});
  OnGiven(make, invocation, arguments, NewToken, /*needs_server=*/false);
  Command hash = command.AddCommand("hash", "Print the hash of a token read from standard input");
  OnGiven(hash, invocation, HashToken, /*needs_server=*/false);
}

}  // namespace hulld
