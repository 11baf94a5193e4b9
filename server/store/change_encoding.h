#ifndef HULLD_SERVER_STORE_CHANGE_ENCODING_H_
#define HULLD_SERVER_STORE_CHANGE_ENCODING_H_

#include <rocksdb/write_batch.h>

#include <string>

#include "server/store/store.h"

namespace hulld::server {

// Adds a value with its checksum to the batch.
void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value);

// Adds the effect of a change on the keys of the store (store_keys.h), except the store's revision.
void EncodeChange(rocksdb::WriteBatch& batch, const Change& change);

// Returns true if the change deletes or replaces a hull with a damaged record. EncodeChange does
// not find the other values of such a hull.
bool EndsUnknown(const Change& change);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_CHANGE_ENCODING_H_
