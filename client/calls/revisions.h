#ifndef HULLD_CLIENT_CALLS_REVISIONS_H_
#define HULLD_CLIENT_CALLS_REVISIONS_H_

#include "hulld/v1/freshness.pb.h"
#include "hulld/v1/geometry.pb.h"
#include "hulld/v1/hull.pb.h"

namespace hulld {

// Makes the freshness ask for at least the revision that an answer with this header was of, in each
// of its stores. What it asked for of these stores, or of another one in at_least_revision, is
// replaced.
void AskForAtLeast(const v1::ResponseHeader& header, v1::Freshness* freshness);

// The watch resumes after the last message that it told, which had this header.
void ResumeAfter(const v1::ResponseHeader& header, v1::WatchHullsRequest* request);
// Whether it resumes after anything.
bool IsResumed(const v1::WatchHullsRequest& request);

}  // namespace hulld

#endif  // HULLD_CLIENT_CALLS_REVISIONS_H_
