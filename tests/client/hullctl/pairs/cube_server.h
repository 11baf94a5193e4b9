#ifndef HULLD_TESTS_CLIENT_HULLCTL_PAIRS_CUBE_SERVER_H_
#define HULLD_TESTS_CLIENT_HULLCTL_PAIRS_CUBE_SERVER_H_

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/client/hullctl/hullctl_on_server.h"

namespace hulld {

// hullctl, a server with the unit cube "cube", and a temporary folder of input files.
class CubeServer : public HullctlOnServer {
 protected:
  CubeServer() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hullctl-XXXXXX").string();
    EXPECT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
  }
  ~CubeServer() override { std::filesystem::remove_all(folder_); }

  void SetUp() override {
    HullctlOnServer::SetUp();
    Put("cube", server::Cube());
  }

  // Writes a file of the folder and returns its path.
  std::string Write(const std::string& name, const std::string& text) const {
    const std::filesystem::path path = folder_ / name;
    std::ofstream(path) << text;
    return path.string();
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace hulld

#endif  // HULLD_TESTS_CLIENT_HULLCTL_PAIRS_CUBE_SERVER_H_
