#ifndef HULLD_TESTS_SERVER_HARNESS_KEPT_STORE_H_
#define HULLD_TESTS_SERVER_HARNESS_KEPT_STORE_H_

#include <absl/status/statusor.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/store/store.h"
#include "tests/server/harness/store_fixture.h"

namespace hulld::server {

// Over any store that keeps hulls.
using KeptRegistry = TestRegistry<Store>;

// One store of some kind, as tests open it, look into it and damage it. Values go by the keys of
// store_keys.h, wherever the store puts them, and must be there.
class KeptStore {
 public:
  virtual ~KeptStore() = default;
  // What was open before must be closed.
  virtual absl::StatusOr<std::unique_ptr<Store>> Open() = 0;
  virtual uint64_t latest_format() const = 0;

  // Requires that it is open.
  virtual std::string Get(const std::string& key) = 0;
  virtual void Put(const std::string& key, const std::string& value) = 0;
  virtual void Delete(const std::string& key) = 0;
  // Values of one kind.
  virtual size_t Count(char prefix) = 0;
  virtual void SetFormat(uint64_t format) = 0;
};

// A test that holds for each of them: "rocksdb", "postgres".
class KeptStoreTest : public ::testing::TestWithParam<const char*> {
 protected:
  // Skips the test where what it needs is not installed.
  void SetUp() override;
  void TearDown() override { hulls_ = nullptr; }

  // The store must open. Closes the one that was open before.
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
