#include "client/hullctl/context/context_file.h"

#include <absl/strings/str_cat.h>
#include <fcntl.h>
#include <google/protobuf/struct.pb.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "client/base/status_macros.h"
#include "client/formats/text_number.h"
#include "client/hullctl/help/suggestion.h"
#include "client/hullctl/printing/json.h"

namespace hulld {
namespace {

using google::protobuf::Struct;
using google::protobuf::Value;

// Maximum size of a context file; a larger file is not a context file.
constexpr size_t kMaxContextBytes = size_t{1} << 20;

absl::Status Damaged(const std::string& path, const std::string& what) {
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": ", what,
                   "; fix it, or delete it and add the contexts again with 'hullctl context add'"));
}

const ConnectionSetting* SettingNamed(const std::string& name) {
  for (const ConnectionSetting& setting : kConnectionSettings) {
    if (name == setting.name) return &setting;
  }
  return nullptr;
}

absl::StatusOr<ConnectionSettings> ReadContext(const std::string& path, const std::string& name,
                                               const Value& value) {
  const std::string place = absl::StrCat("context ", Quoted(name));
  if (const std::string problem = ContextNameProblem(name); !problem.empty()) {
    return Damaged(path, absl::StrCat(place, ": ", problem));
  }
  if (!value.has_struct_value()) return Damaged(path, place + " is not an object");
  ConnectionSettings settings;
  for (const auto& [member, text] : value.struct_value().fields()) {
    const ConnectionSetting* const setting = SettingNamed(member);
    if (setting == nullptr) {
      return Damaged(path, absl::StrCat(place, " has the member ", Quoted(member),
                                        ", which is not a setting of a context"));
    }
    const bool is_flag = setting->kind == SettingKind::kFlag;
    if (is_flag && text.kind_case() == Value::kBoolValue) {
      settings[member] = text.bool_value() ? "true" : "false";
    } else if (!is_flag && text.kind_case() == Value::kStringValue) {
      settings[member] = text.string_value();
    } else {
      return Damaged(path, absl::StrCat(place, ": ", member, " is not ",
                                        is_flag ? "true or false" : "a string"));
    }
  }
  if (!settings.contains("server")) return Damaged(path, place + " has no server");
  return settings;
}

std::string ToJson(const ContextFile& file) {
  std::string contexts;
  for (const auto& [name, settings] : file.contexts) {
    std::string members;
    for (const auto& [member, text] : settings) {
      const bool is_flag = SettingNamed(member)->kind == SettingKind::kFlag;
      absl::StrAppend(&members, members.empty() ? "\n      " : ",\n      ", QuoteJson(member), ": ",
                      is_flag ? text : QuoteJson(text));
    }
    absl::StrAppend(&contexts, contexts.empty() ? "\n    " : ",\n    ", QuoteJson(name), ": {",
                    members, "\n    }");
  }
  return absl::StrCat("{\n  \"current\": ", QuoteJson(file.current), ",\n  \"contexts\": {",
                      contexts, "\n  }\n}\n");
}

// Writes the whole text and syncs it to disk.
bool WriteAll(int descriptor, const std::string& text) {
  size_t written = 0;
  while (written < text.size()) {
    const ssize_t n = write(descriptor, text.data() + written, text.size() - written);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    written += static_cast<size_t>(n);
  }
  return fsync(descriptor) == 0;
}

absl::Status CannotWrite(const std::string& place, int error) {
  return absl::InvalidArgumentError(
      absl::StrCat(place, " cannot be written: ", std::strerror(error)));
}

absl::Status CreateFolder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder.parent_path(), error);
  if (error) return CannotWrite(folder.string(), error.value());
  if (mkdir(folder.c_str(), 0700) == 0 || errno == EEXIST) return absl::OkStatus();
  return CannotWrite(folder.string(), errno);
}

}  // namespace

std::string ContextFilePath() {
  const char* const config = std::getenv("XDG_CONFIG_HOME");
  // The XDG specification requires relative paths to be ignored.
  if (config != nullptr && *config == '/') return absl::StrCat(config, "/hullctl/contexts.json");
  const char* const home = std::getenv("HOME");
  if (home == nullptr || *home == '\0') return "";
  return absl::StrCat(home, "/.config/hullctl/contexts.json");
}

absl::StatusOr<ContextFile> ReadContextFile() {
  ContextFile file;
  const std::string path = ContextFilePath();
  if (path.empty()) return file;
  struct stat info = {};
  if (stat(path.c_str(), &info) != 0 && (errno == ENOENT || errno == ENOTDIR)) return file;
  errno = 0;
  std::ifstream stream(path, std::ios::binary);
  if (!stream || S_ISDIR(info.st_mode)) {
    return Damaged(path,
                   absl::StrCat("cannot be read: ", std::strerror(errno != 0 ? errno : EISDIR)));
  }
  std::string text(kMaxContextBytes + 1, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<size_t>(stream.gcount()));
  if (text.size() > kMaxContextBytes) return Damaged(path, "the file is too large");
  Struct json;
  if (const absl::Status parsed = ParseJson(text, UnknownFields::kRefuse, &json); !parsed.ok()) {
    const std::string message(parsed.message());
    return Damaged(path, "not JSON: " + message.substr(0, message.find('\n')));
  }
  for (const auto& [member, value] : json.fields()) {
    if (member == "current" && value.kind_case() == Value::kStringValue) {
      file.current = value.string_value();
    } else if (member == "contexts" && value.has_struct_value()) {
      for (const auto& [name, context] : value.struct_value().fields()) {
        auto settings = ReadContext(path, name, context);
        if (!settings.ok()) return settings.status();
        file.contexts[name] = *std::move(settings);
      }
    } else {
      return Damaged(path, absl::StrCat("the member ", Quoted(member), " is unknown"));
    }
  }
  if (!file.current.empty() && !file.contexts.contains(file.current)) {
    return Damaged(path,
                   absl::StrCat("its current context ", Quoted(file.current), " does not exist"));
  }
  return file;
}

absl::StatusOr<ContextFile> LockContextFile() {
  const std::filesystem::path folder = std::filesystem::path(ContextFilePath()).parent_path();
  // If the folder cannot be created or locked, WriteContextFile reports why, or succeeds.
  CreateFolder(folder).IgnoreError();
  const int descriptor = open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const std::shared_ptr<const void> lock(nullptr, [=](const void*) { close(descriptor); });
  while (flock(descriptor, LOCK_EX) != 0 && errno == EINTR) {
  }
  HULLD_ASSIGN_OR_RETURN(ContextFile file, ReadContextFile());
  file.lock = lock;
  return file;
}

absl::Status WriteContextFile(const ContextFile& file) {
  std::string path = ContextFilePath();
  if (path.empty()) {
    return absl::InvalidArgumentError(
        "cannot determine the folder of contexts; set HOME or XDG_CONFIG_HOME");
  }
  HULLD_RETURN_IF_ERROR(CreateFolder(std::filesystem::path(path).parent_path()));
  std::error_code ignored;
  if (std::filesystem::is_symlink(path, ignored) && std::filesystem::exists(path, ignored)) {
    path = std::filesystem::canonical(path, ignored).string();
  }
  std::string draft = path + ".XXXXXX";
  // mkstemp creates files that only their owner may read.
  const int descriptor = mkstemp(draft.data());
  if (descriptor < 0) return CannotWrite(path, errno);
  const bool written = WriteAll(descriptor, ToJson(file));
  int failed = written ? 0 : errno;
  close(descriptor);
  if (written && rename(draft.c_str(), path.c_str()) != 0) failed = errno;
  if (failed == 0) return absl::OkStatus();
  unlink(draft.c_str());
  return CannotWrite(path, failed);
}

std::string ContextNameProblem(const std::string& name) {
  constexpr size_t kLongest = 64;
  const bool fits =
      !name.empty() && name.size() <= kLongest && name[0] != '-' && name[0] != '.' &&
      name.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._-") ==
          std::string::npos;
  return fits ? "" : "a name is up to 64 of [A-Za-z0-9._-] and starts with a letter or digit";
}

absl::StatusOr<ConnectionSettings> FindContext(const ContextFile& file, const std::string& name) {
  const auto found = file.contexts.find(name);
  if (found != file.contexts.end()) return found->second;
  std::vector<std::string> names;
  for (const auto& [known, settings] : file.contexts) names.push_back(known);
  std::string hint = Suggestion(name, names);
  if (hint.empty()) {
    hint = names.empty() ? "; add it with 'hullctl context add'" : "; see 'hullctl context list'";
  }
  return absl::InvalidArgumentError(absl::StrCat("unknown context ", Quoted(name), hint));
}

}  // namespace hulld
