// The tables of the records, and migrations from older schemas.
#pragma once

#include <cstdint>

#include "server/training/database.hpp"

namespace parhelion::training {

/// Schema version written by this program (PRAGMA user_version).
std::int64_t newest_schema();

/// Migrates a new or older database to schema `target`, each step in its own transaction. Error: a newer
/// schema, or another program's file.
Status migrate(Database& database, std::int64_t target = newest_schema());

}  // namespace parhelion::training
