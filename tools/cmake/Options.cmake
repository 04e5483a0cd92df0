# Compile options of every target. The flags of promise 4: portable baseline, no contraction, no fast maths.
set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE Release)
endif()

set(PARHELION_SANITIZE "" CACHE STRING "Sanitizers, as -fsanitize= takes them")
# A sanitizer checks more, and replaces the functions that _FORTIFY_SOURCE checks.
set(harden ON)
if(PARHELION_SANITIZE)
  set(harden OFF)
endif()
option(PARHELION_HARDEN "Checks at run time against faults of memory" ${harden})
# The short sanitized form does not test them, and they would take a fifth of its compile time.
set(PARHELION_FROM_RELEASE "" CACHE STRING "Libraries taken from build/release where it is built")
option(PARHELION_FUZZ "Build the libFuzzer targets (clang only)" OFF)

find_program(CCACHE ccache)
# ccache's own variable: set where the cache would be empty, as in CI.
if(DEFINED ENV{CCACHE_DISABLE})
  set(CCACHE "")
endif()
if(CCACHE)
  set(CMAKE_CXX_COMPILER_LAUNCHER ${CCACHE})
endif()

# Precompiled headers make a clean build over a quarter shorter. For frequent builds a compiler cache is
# better, but it does not work with precompiled headers of another folder.
set(precompile ON)
if(CCACHE)
  set(precompile OFF)
endif()
option(PARHELION_PRECOMPILE "Precompile what most sources include" ${precompile})
# Twelve sources compiled together take a fifth to a third less time: some of it goes to the templates that they
# share. It rebuilds more after a change, so it goes with precompiled headers.
option(PARHELION_UNITY "Compile several sources of a target together" ${PARHELION_PRECOMPILE})
find_package(Python3 REQUIRED COMPONENTS Interpreter)

# Optimization level of code that is rarely run and slow to compile. Under sanitizers most compile time is
# spent there too; code of the tick keeps the preset's level.
set(PARHELION_COLD $<$<CONFIG:Release>:-O1>)
if(PARHELION_SANITIZE)
  set(PARHELION_COLD -O0)
endif()

include(GNUInstallDirs)
# Components of the packages, tools/package: `program` and, for what no processor type matters, `data`.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME program)
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 REQUIRED NO_MODULE)

add_library(parhelion_flags INTERFACE)
target_include_directories(parhelion_flags INTERFACE ${CMAKE_SOURCE_DIR})
# Where several sources are compiled together, names of one may hide those of another.
target_compile_options(parhelion_flags INTERFACE -Wall -Wextra -Wpedantic
  $<$<NOT:$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wshadow> -Wnon-virtual-dtor -Woverloaded-virtual -Werror
  -ffp-contract=off)
# GCC 12 reports false overlaps in std::string's operator+ (GCC bug 105651).
# GCC 12's SLP vectorizer drops the rounding of double -> float -> double, so that release and debug would give
# different bytes (promise 4; tests/protocols/compiler_test.cpp).
target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict -fno-tree-slp-vectorize>)
# Types of an unnamed namespace in those of a header that no other file includes.
target_compile_options(parhelion_flags INTERFACE
  $<$<AND:$<CXX_COMPILER_ID:GNU>,$<BOOL:$<TARGET_PROPERTY:UNITY_BUILD>>>:-Wno-subobject-linkage>)
# GCC frees memory from 128 MB on, which takes a tenth of the time; here from 1 GB on.
target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1000000>)
if(PARHELION_PRECOMPILE)
  # Other symptoms of that bug with precompiled standard headers.
  target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds -Wno-stringop-overflow
    -Wno-stringop-overread>)
  # Some libraries require it, and a precompiled header needs equal flags for all.
  target_compile_options(parhelion_flags INTERFACE -pthread)
endif()
target_link_libraries(parhelion_flags INTERFACE Eigen3::Eigen Threads::Threads)
if(PARHELION_HARDEN)
  # What Debian's hardening-wrapper sets, and checked accesses to the standard library's containers.
  target_compile_options(parhelion_flags INTERFACE -fstack-protector-strong -fcf-protection)
  target_compile_definitions(parhelion_flags INTERFACE _GLIBCXX_ASSERTIONS $<$<NOT:$<CONFIG:Debug>>:_FORTIFY_SOURCE=2>)
  target_link_options(parhelion_flags INTERFACE -Wl,-z,relro,-z,now)
endif()
if(PARHELION_SANITIZE)
  target_compile_options(parhelion_flags INTERFACE -fsanitize=${PARHELION_SANITIZE} -fno-omit-frame-pointer
    -fno-sanitize-recover=all)
  # A large part of the compile time of tests; the modules themselves are checked for undefined behaviour.
  target_compile_options(parhelion_flags INTERFACE
    $<$<BOOL:$<TARGET_PROPERTY:PARHELION_TEST>>:-fno-sanitize=undefined>)
  # Checks of each access through a pointer take two fifths of the compile time. The address sanitizer finds those
  # that do harm; protocols, which reads what strangers send, has them all.
  if(CMAKE_CXX_COMPILER_ID STREQUAL Clang AND NOT "$ENV{PARHELION_LONG}" STREQUAL "1")
    set(not_every $<NOT:$<BOOL:$<TARGET_PROPERTY:PARHELION_EVERY_CHECK>>>)
    target_compile_options(parhelion_flags INTERFACE
      $<${not_every}:-fno-sanitize=null,alignment,vptr,object-size,pointer-overflow>)
  endif()
  target_link_options(parhelion_flags INTERFACE -fsanitize=${PARHELION_SANITIZE})
  foreach(sanitizer address thread)
    if(PARHELION_SANITIZE MATCHES ${sanitizer})
      string(TOUPPER ${sanitizer} name)
      target_compile_definitions(parhelion_flags INTERFACE PARHELION_${name}_SANITIZER)
    endif()
  endforeach()
  # With sanitizers GCC 12 reports std::regex as uninitialized; the sanitizers themselves check at run time.
  target_compile_options(parhelion_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized>)
endif()
# parhelion_precompile(name header [LINK libraries]): a header for targets compiled with the same flags, which
# use it by parhelion_use_precompiled(target name).
function(parhelion_precompile name header)
  cmake_parse_arguments(ARG "" "" "LINK" ${ARGN})
  if(PARHELION_PRECOMPILE)
    # A separate target: definitions of one module would otherwise be required of all.
    file(CONFIGURE OUTPUT ${name}.cpp CONTENT "")
    add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE parhelion_flags ${ARG_LINK})
    target_precompile_headers(${name} PRIVATE ${CMAKE_SOURCE_DIR}/${header})
  endif()
endfunction()

function(parhelion_use_precompiled target name)
  if(PARHELION_PRECOMPILE)
    target_precompile_headers(${target} REUSE_FROM ${name})
  endif()
endfunction()

parhelion_precompile(precompiled tools/cmake/precompiled.hpp)
if(PARHELION_SANITIZE)
  parhelion_precompile(precompiled_outside_tick tools/cmake/precompiled.hpp)
  if(TARGET precompiled_outside_tick)
    target_compile_options(precompiled_outside_tick PRIVATE ${PARHELION_COLD})
  endif()
endif()

# parhelion_compile_together(target): in batches of sources that do not define what another one of them names. A
# name that is new in a batch may not compile until CMake has run again.
function(parhelion_compile_together target)
  if(NOT PARHELION_UNITY)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cpp$")
  execute_process(COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/tools/cmake/batches.py 12 ${sources}
    WORKING_DIRECTORY ${CMAKE_CURRENT_SOURCE_DIR} OUTPUT_VARIABLE lines OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  string(REPLACE "\n" ";" lines "${lines}")
  foreach(line ${lines})
    string(REGEX MATCH "^([0-9]+)=(.*)$" line "${line}")
    set_source_files_properties(${CMAKE_MATCH_2} PROPERTIES UNITY_GROUP ${CMAKE_MATCH_1})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
endfunction()

# parhelion_library(name SOURCES... [PUBLIC targets] [PRIVATE targets] [SYSTEM include dirs]
#                   [OUTSIDE_TICK: not optimized under sanitizers]
#                   [PRECOMPILED by parhelion_precompile, if it is not the modules' common one])
function(parhelion_library name)
  cmake_parse_arguments(ARG "OUTSIDE_TICK" "PRECOMPILED" "SOURCES;PUBLIC;PRIVATE;SYSTEM" ${ARGN})
  file(RELATIVE_PATH folder ${CMAKE_SOURCE_DIR} ${CMAKE_CURRENT_SOURCE_DIR})
  set(built ${CMAKE_SOURCE_DIR}/build/release/${folder}/lib${name}.a)
  if(name IN_LIST PARHELION_FROM_RELEASE AND EXISTS ${built} AND NOT "$ENV{PARHELION_LONG}" STREQUAL "1")
    message(STATUS "${name}: as the release build has it")
    add_library(${name} INTERFACE)
    target_link_libraries(${name} INTERFACE ${built} parhelion_flags ${ARG_PUBLIC} ${ARG_PRIVATE})
    return()
  endif()
  if(ARG_OUTSIDE_TICK AND PARHELION_SANITIZE)
    set(ARG_PRECOMPILED precompiled_outside_tick)
  elseif(NOT ARG_PRECOMPILED)
    set(ARG_PRECOMPILED precompiled)
  endif()
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC parhelion_flags ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  target_include_directories(${name} SYSTEM PRIVATE ${ARG_SYSTEM})
  if(ARG_OUTSIDE_TICK AND PARHELION_SANITIZE)
    target_compile_options(${name} PRIVATE ${PARHELION_COLD})
  endif()
  parhelion_use_precompiled(${name} ${ARG_PRECOMPILED})
  parhelion_compile_together(${name})
endfunction()

# parhelion_cold(SOURCES...): rarely run, slow to compile. With a precompiled header, GCC uses its level of
# optimization.
function(parhelion_cold)
  set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS ${PARHELION_COLD} SKIP_PRECOMPILE_HEADERS ON)
endfunction()
