#ifndef HULLD_TESTS_BENCH_POSTGRES_LIBPQ_FLOOR_H_
#define HULLD_TESTS_BENCH_POSTGRES_LIBPQ_FLOOR_H_

#include <libpq-fe.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace hulld::bench {

// The cost of libpq and PostgreSQL alone for hulld's requests: the same prepared statements with
// parameters of the same bytes, in the same pipelines, in sequence.
class LibpqFloor {
 public:
  // conninfo: a database where a hulld stored `hull_id`; its rows are the model of the statements.
  // No hulld may have the database open. shared: that hulld was one of many (--postgres-servers
  // many). Ends the program with a message on any failure.
  LibpqFloor(const std::string& conninfo, const std::string& hull_id, bool shared);

  // Commits the changes of a single-point chunk. Cost: one round trip, or two if shared.
  void Commit();
  // Read index: fetches the commits of peer servers. Requires: shared. Cost: one round trip.
  void Follow();

 private:
  struct Statement {
    const char* name = nullptr;
    std::vector<std::string> parameters = {};
  };

  void Run(const std::string& text);
  std::string Value(const std::string& query);
  void Execute(const std::vector<Statement>& statements);
  std::vector<Statement> Puts() const;
  Statement Fence() const;
  Statement FetchPeerChanges() const;

  const bool shared_;
  const std::string hull_id_;
  const std::unique_ptr<PGconn, decltype(&PQfinish)> connection_;
  uint64_t incarnation_ = 0;
  uint64_t epoch_ = 0;
  uint64_t batch_ = 0;
  uint64_t revision_ = 0;
  std::string record_;
  std::string writer_id_;
  std::string sequence_;
  std::string delta_;
};

// Runs one statement as a role that may create databases. Returns the first column of its first
// row, or empty.
std::string RunSql(const std::string& conninfo, const std::string& statement);

}  // namespace hulld::bench

#endif  // HULLD_TESTS_BENCH_POSTGRES_LIBPQ_FLOOR_H_
