#ifndef HULLD_TESTS_SERVER_HARNESS_KEPT_STORE_H_
#define HULLD_TESTS_SERVER_HARNESS_KEPT_STORE_H_

#include <absl/status/statusor.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/store/store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {

// A registry over any persistent store.
using KeptRegistry = TestRegistry<Store>;

// A persistent store that tests can open, inspect, and damage. Values are addressed by the keys of
// store_keys.h, wherever the store keeps them. Requires: the value exists.
class KeptStore {
 public:
  virtual ~KeptStore() = default;
  // Requires: any store opened before is closed.
  virtual absl::StatusOr<std::unique_ptr<Store>> Open() = 0;
  // The formats that it may be in, ascending; a new store is in the last one.
  virtual std::vector<uint64_t> formats() const = 0;

  // Requires: the store is open.
  virtual std::string Get(const std::string& key) = 0;
  virtual void Put(const std::string& key, const std::string& value) = 0;
  virtual void Delete(const std::string& key) = 0;
  // Returns the number of values with this prefix.
  virtual size_t Count(char prefix) = 0;
  virtual void SetFormat(uint64_t format) = 0;
};

// A test parameterized by persistent store: "rocksdb", "postgres".
class KeptStoreTest : public ::testing::TestWithParam<const char*> {
 protected:
  // Skips the test if its store is not installed.
  void SetUp() override;
  void TearDown() override { hulls_ = nullptr; }

  // Closes the open store and opens it again; this must succeed.
  KeptRegistry& Start(const Limits& limits = {});

  std::unique_ptr<KeptStore> kept_;
  std::unique_ptr<KeptRegistry> hulls_;
};

// For INSTANTIATE_TEST_SUITE_P.
inline auto KeptStores() { return ::testing::Values("rocksdb", "postgres"); }
inline std::string KeptStoreName(const ::testing::TestParamInfo<const char*>& kind) {
  return kind.param;
}

}  // namespace hulld::server

#endif  // HULLD_TESTS_SERVER_HARNESS_KEPT_STORE_H_
