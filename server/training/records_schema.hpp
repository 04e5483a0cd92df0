// The tables of the records, and how older ones become the newest.
#pragma once

#include <cstdint>

#include "server/training/database.hpp"

namespace parhelion::training {

/// Of the records that this program writes (PRAGMA user_version).
std::int64_t newest_schema();

/// Brings a new or older database to schema `target`, each step in a transaction of its own. Error: it is of
/// a newer schema, or another program's.
Status migrate(Database& database, std::int64_t target = newest_schema());

}  // namespace parhelion::training
