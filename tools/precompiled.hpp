// What most commands include, as tools/cmake/precompiled.hpp is for the rooms.
#pragma once

#include <CLI/CLI.hpp>
#include <iostream>

#include "tools/cmake/precompiled.hpp"
