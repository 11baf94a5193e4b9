#ifndef HULLD_SERVER_STORE_CHANGE_ENCODING_H_
#define HULLD_SERVER_STORE_CHANGE_ENCODING_H_

#include <rocksdb/write_batch.h>

#include <string>

#include "server/store/store.h"

namespace hulld::server {

// Puts a value with its checksum.
void PutSealed(rocksdb::WriteBatch& batch, const std::string& key, std::string value);

// Puts what a change does to the keys of the store (store_keys.h), all but the store's revision.
void EncodeChange(rocksdb::WriteBatch& batch, const Change& change);

// Whether the change deletes or replaces a hull of which no more than the ID is known, as its
// record is damaged: what else is kept of it is not found by EncodeChange.
bool EndsUnknown(const Change& change);

}  // namespace hulld::server

#endif  // HULLD_SERVER_STORE_CHANGE_ENCODING_H_
