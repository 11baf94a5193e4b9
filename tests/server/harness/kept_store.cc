#include "tests/server/harness/kept_store.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include <utility>
#include <vector>

#include "core/base/check.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/rocksdb_store.h"
#include "server/store/store_keys.h"
#include "tests/server/harness/postgres/postgres_cluster.h"

namespace hulld::server {
namespace {

class KeptRocksDb : public KeptStore {
 public:
  KeptRocksDb() {
    std::string name = ::testing::TempDir() + "hulld_store_XXXXXX";
    directory_ = mkdtemp(name.data());
  }
  ~KeptRocksDb() override { std::filesystem::remove_all(directory_); }

  absl::StatusOr<std::unique_ptr<Store>> Open() override {
    RocksDbOptions options;
    options.data_dir = directory_ + "/data";
    absl::StatusOr<std::unique_ptr<RocksDbStore>> store = RocksDbStore::Open(options);
    if (!store.ok()) return store.status();
    store_ = store->get();
    return *std::move(store);
  }
  std::vector<uint64_t> formats() const override { return {kFormatWithoutBodies, kStoreFormat}; }

  std::string Get(const std::string& key) override {
    std::string value;
    EXPECT_TRUE(store_->db().Get({}, key, &value).ok());
    return value;
  }
  void Put(const std::string& key, const std::string& value) override {
    EXPECT_TRUE(store_->db().Put({}, key, value).ok());
  }
  void Delete(const std::string& key) override { EXPECT_TRUE(store_->db().Delete({}, key).ok()); }
  size_t Count(char prefix) override {
    const std::unique_ptr<rocksdb::Iterator> it(store_->db().NewIterator({}));
    size_t count = 0;
    for (it->Seek(std::string(1, prefix)); it->Valid() && it->key()[0] == prefix; it->Next()) {
      ++count;
    }
    return count;
  }
  void SetFormat(uint64_t format) override {
    Put(kFormatKey, Seal(kFormatKey, EncodeNumber(format)));
  }

 private:
  std::string directory_;
  RocksDbStore* store_ = nullptr;
};

class KeptPostgres : public KeptStore {
 public:
  absl::StatusOr<std::unique_ptr<Store>> Open() override {
    PostgresOptions options;
    options.conninfo = PostgresCluster::Shared().Conninfo(database_);
    return PostgresStore::Open(std::move(options));
  }
  std::vector<uint64_t> formats() const override { return {PostgresStore::kFormat}; }

  std::string Get(const std::string& key) override {
    const Place place = PlaceOf(key);
    const std::vector<std::string> rows = RunSql(absl::StrCat(
        "SELECT encode(", place.column, ", 'hex') FROM hulld.", place.table, place.where));
    HULLD_CHECK(rows.size() == 1);
    return absl::HexStringToBytes(rows.front());
  }
  void Put(const std::string& key, const std::string& value) override {
    const Place place = PlaceOf(key);
    Change(absl::StrCat("UPDATE hulld.", place.table, " SET ", place.column, " = decode('",
                        absl::BytesToHexString(value), "', 'hex')", place.where));
  }
  void Delete(const std::string& key) override {
    const Place place = PlaceOf(key);
    Change(absl::StrCat("DELETE FROM hulld.", place.table, place.where));
  }
  size_t Count(char prefix) override {
    return std::stoull(RunSql(absl::StrCat("SELECT count(*) FROM hulld.",
                                           PlaceOf(IncarnationKey(prefix, 0)).table))
                           .front());
  }
  void SetFormat(uint64_t format) override {
    Change(absl::StrCat("UPDATE hulld.store SET format = ", format));
  }

 private:
  struct Place {
    std::string table;
    std::string column;
    std::string where;
  };

  static uint64_t NumberAt(const std::string& key, size_t at, size_t bytes) {
    uint64_t number = 0;
    for (const char c : key.substr(std::min(at, key.size()), bytes)) {
      number = number << 8 | static_cast<unsigned char>(c);
    }
    return number;
  }

  // Returns the location of the value of a store_keys.h key.
  static Place PlaceOf(const std::string& key) {
    const std::string incarnation = absl::StrCat(" WHERE incarnation = ", NumberAt(key, 1, 8));
    const std::string revision = absl::StrCat(incarnation, " AND revision = ", NumberAt(key, 9, 8));
    switch (key.front()) {
      case kHullPrefix:
        return {"hulls", "record", absl::StrCat(" WHERE hull_id = '", key.substr(1), "'")};
      case kBodyPrefix:
        return {"bodies", "body", absl::StrCat(" WHERE body_id = '", key.substr(1), "'")};
      case kWriterPrefix:
        return {"writers", "sequence",
                absl::StrCat(incarnation, " AND writer_id = '", key.substr(9), "'")};
      case kBasePrefix:
        return {"bases", "vertices", absl::StrCat(revision, " AND part = ", NumberAt(key, 17, 4))};
      case kDeltaPrefix:
        return {"deltas", "vertices", revision};
      default:
        HULLD_CHECK(false);
        return {};
    }
  }

  std::vector<std::string> RunSql(const std::string& sql) const {
    return PostgresCluster::Shared().RunSql(database_, sql);
  }
  // Requires: the statement changes exactly one row.
  void Change(const std::string& sql) const {
    HULLD_CHECK(RunSql(sql + " RETURNING 1").size() == 1);
  }

  const std::string database_ = PostgresCluster::Shared().MakeDatabase();
};

}  // namespace

void KeptStoreTest::SetUp() {
  if (GetParam() == std::string_view("rocksdb")) {
    kept_ = std::make_unique<KeptRocksDb>();
    return;
  }
  if (!PostgresCluster::IsInstalled()) GTEST_SKIP() << PostgresCluster::kMissing;
  kept_ = std::make_unique<KeptPostgres>();
}

KeptRegistry& KeptStoreTest::Start(const Limits& limits) {
  hulls_ = nullptr;
  absl::StatusOr<std::unique_ptr<Store>> store = kept_->Open();
  if (!store.ok()) {
    ADD_FAILURE() << store.status();
    std::abort();
  }
  hulls_ = std::make_unique<KeptRegistry>(*std::move(store), limits);
  EXPECT_TRUE(hulls_->loaded().ok()) << hulls_->loaded();
  return *hulls_;
}

}  // namespace hulld::server
