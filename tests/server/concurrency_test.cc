#include <absl/strings/str_cat.h>
#include <gtest/gtest.h>

#include <atomic>
#include <iterator>
#include <random>
#include <set>
#include <string>
#include <thread>

#include "tests/server/harness/test_server.h"

namespace hulld::server {
namespace concurrency_test {

using Concurrency = ServerTest;

TEST_F(Concurrency, ManyWritersAndReadersOfOneHullSeeRevisionsGrow) {
  constexpr int kWriters = 4;
  constexpr int kChunks = 60;
  Create("shared");
  Put("probe", {0, 0, 0});
  std::atomic<int> writing = kWriters;
  std::vector<std::thread> threads;
  for (int w = 0; w < kWriters; ++w) {
    threads.emplace_back([&, w] {
      std::mt19937 random(w);
      std::uniform_real_distribution<double> coordinate(-1, 1);
      Appender appender(*hulls_, "shared", absl::StrCat("writer-", w));
      uint64_t revision = 0;
      for (int i = 1; i <= kChunks; ++i) {
        Coordinates xyz(300);
        for (double& x : xyz) x = coordinate(random) * i;
        const auto ack = appender.Append(i, xyz);
        ASSERT_TRUE(ack.has_value());
        EXPECT_GE(ack->hull_revision(), revision);
        EXPECT_GE(ack->header().revision(), ack->hull_revision());
        revision = ack->hull_revision();
      }
      EXPECT_TRUE(appender.Finish().ok());
      --writing;
    });
  }
  for (int r = 0; r < 2; ++r) {
    threads.emplace_back([&] {
      uint64_t revision = 0;
      uint64_t received = 0;
      while (writing > 0) {
        const v1::GetHullResponse hull = Get("shared");
        EXPECT_GE(hull.hull().revision(), revision);
        EXPECT_GE(hull.header().revision(), hull.hull().revision());
        EXPECT_GE(hull.hull().counts().received(), received);
        EXPECT_EQ(hull.hull().counts().received() % 100, 0);
        revision = hull.hull().revision();
        received = hull.hull().counts().received();
        v1::CheckCollisionRequest request;
        *request.mutable_a() = PlacementOf("shared");
        *request.mutable_b() = PlacementOf("probe");
        EXPECT_GE(Check(request).hull_a().revision(), revision);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const v1::GetHullResponse hull = Get("shared");
  EXPECT_EQ(hull.hull().counts().received(), kWriters * kChunks * 100);

  // A single chunk with all points yields the same hull.
  Coordinates all;
  for (int w = 0; w < kWriters; ++w) {
    std::mt19937 random(w);
    std::uniform_real_distribution<double> coordinate(-1, 1);
    for (int i = 1; i <= kChunks; ++i) {
      for (int k = 0; k < 300; ++k) all.push_back(coordinate(random) * i);
    }
  }
  Put("alone", all);
  const v1::GetHullResponse alone = Get("alone");
  EXPECT_EQ(alone.hull().vertex_count(), hull.hull().vertex_count());
  EXPECT_EQ(alone.facet_count(), hull.facet_count());
  EXPECT_EQ(alone.box_max().DebugString(), hull.box_max().DebugString());
}

TEST_F(Concurrency, WritersOfOneNameCommitEachSequenceOnce) {
  constexpr int kChunks = 200;
  Create("h");
  std::atomic<int> applied = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      Appender appender(*hulls_, "h", "same");
      for (uint64_t i = appender.opened().last_sequence() + 1; i <= kChunks; ++i) {
        const auto ack = appender.Append(i, {static_cast<double>(i), 0, 0});
        ASSERT_TRUE(ack.has_value());
        if (ack->outcome() == v1::APPEND_OUTCOME_APPLIED) ++applied;
      }
      EXPECT_TRUE(appender.Finish().ok());
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(applied, kChunks);
  EXPECT_EQ(Get("h").hull().counts().received(), kChunks);
}

TEST_F(Concurrency, ManyReadersOfAChangedHullAgree) {
  Put("ball", Sphere(5000));
  std::vector<std::thread> threads;
  std::vector<std::string> answers(8);
  for (std::string& answer : answers) {
    threads.emplace_back([&] { answer = Get("ball").DebugString(); });
  }
  for (std::thread& thread : threads) thread.join();
  for (const std::string& answer : answers) EXPECT_EQ(answer, answers[0]);
}

TEST_F(Concurrency, BatchesOfHullsThatKeepChangingAnswerFromOneRevision) {
  constexpr int kHulls = 6;
  constexpr int kRounds = 50;
  std::atomic<bool> done = false;
  std::vector<std::set<uint64_t>> revisions(kHulls);
  for (int h = 0; h < kHulls; ++h) {
    revisions[h].insert(Create(absl::StrCat("h", h)).revision());
  }
  std::vector<std::thread> writers;
  for (int h = 0; h < kHulls; ++h) {
    writers.emplace_back([&, h] {
      Appender appender(*hulls_, absl::StrCat("h", h), "w");
      for (uint64_t i = 1; !done; ++i) {
        const auto ack = appender.Append(i, {static_cast<double>(i), 0.0 + h, 0});
        ASSERT_TRUE(ack.has_value());
        revisions[h].insert(ack->hull_revision());
      }
    });
  }
  v1::BatchCheckCollisionsRequest request;
  for (int h = 0; h < kHulls; ++h) *request.add_placements() = PlacementOf(absl::StrCat("h", h));
  std::vector<v1::BatchCheckCollisionsResponse> heads(kRounds);
  for (v1::BatchCheckCollisionsResponse& head : heads) {
    grpc::ClientContext context;
    auto stream = collisions_->BatchCheckCollisions(&context, request);
    EXPECT_TRUE(stream->Read(&head));
    EXPECT_TRUE(stream->Finish().ok());
  }
  done = true;
  for (std::thread& writer : writers) writer.join();
  for (const v1::BatchCheckCollisionsResponse& head : heads) {
    ASSERT_EQ(head.hulls_size(), kHulls);
    for (int h = 0; h < kHulls; ++h) {
      // Each hull is at its last change up to the header's revision.
      EXPECT_EQ(head.hulls(h).revision(),
                *std::prev(revisions[h].upper_bound(head.header().revision())));
    }
  }
}

TEST_F(Concurrency, DeletesDuringWritesEndEveryStream) {
  constexpr int kRounds = 15;
  for (int round = 0; round < kRounds; ++round) {
    Create("h");
    std::atomic<int> started = 0;
    std::vector<std::thread> writers;
    for (int w = 0; w < 3; ++w) {
      writers.emplace_back([&, w] {
        Appender appender(*hulls_, "h", std::to_string(w));
        ASSERT_TRUE(appender.is_open());
        for (uint64_t i = 1; appender.Append(i, Sphere(200, static_cast<double>(i))); ++i) {
          if (i == 1) ++started;
        }
        EXPECT_EQ(appender.Finish().error_code(), grpc::StatusCode::FAILED_PRECONDITION);
      });
    }
    while (started < 3) std::this_thread::yield();
    EXPECT_TRUE(Delete("h").ok());
    for (std::thread& writer : writers) writer.join();
  }
  grpc::ClientContext context;
  v1::GetStatusResponse status;
  ASSERT_TRUE(status_->GetStatus(&context, {}, &status).ok());
  EXPECT_EQ(status.hull_count(), 0);
  EXPECT_EQ(status.vertex_count(), 0);
}

}  // namespace concurrency_test
}  // namespace hulld::server
