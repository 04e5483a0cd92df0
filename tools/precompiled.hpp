// Precompiled header of the commands, like tools/cmake/precompiled.hpp for the modules.
#pragma once

#include <CLI/CLI.hpp>
#include <iostream>

#include "tools/cmake/precompiled.hpp"
