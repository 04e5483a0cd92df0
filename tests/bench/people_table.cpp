// How well fusion/people finds and follows people: prints the tables of docs/measurements/people.md.
//   people_table [crowds] [first seed]
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <numbers>
#include <thread>
#include <vector>

#include "tests/fusion/people/crowd_score.hpp"
#include "tests/fusion/people/depth_score.hpp"
#include "tests/fusion/people/recorded_people.hpp"
#include "tests/recordings.hpp"

namespace parhelion {
namespace {

void row(const std::string& name, const test::PeopleScore& score) {
  std::printf("| %s | %d | %.3f | %s | %.2f, %.2f | %.3f, %.3f m | %.2f, %.2f s |\n", name.c_str(),
              score.wanted, score.recall(),
              score.reported > 0 ? std::to_string(score.precision()).substr(0, 5).c_str() : "-",
              score.switches_a_minute(), score.switches_a_person_minute(), score.error_quantile(0.5),
              score.rms_error(), score.first_detection(0.5), score.first_detection(0.9));
  std::fflush(stdout);
}

void recordings() {
  const auto benchmark = test::recording("people-legtracker-benchmark");
  for (const char* name : {"general_tracking_moving_1", "person_following_outdoor_1"}) {
    for (const char* ending : {".zip", ".bag.zip", ".bag"}) {
      const auto path = benchmark / (std::string(name) + ending);
      if (std::filesystem::exists(path)) row(name, score(test::read_benchmark(path)));
    }
  }
  for (const char* name : {"positive_1", "positive_6"}) {
    const auto folder = test::recording("people-legtracker");
    const auto scans = folder / (std::string(name) + ".bag"),
               legs = folder / (std::string(name) + "_extracted.bag");
    if (std::filesystem::exists(scans) && std::filesystem::exists(legs))
      row(name, score(test::read_legs(scans, legs)));
  }
}

/// The scores of `n` scenes, on all cores; added in order.
template <class Score>
test::PeopleScore sum(int n, Score&& score_of) {
  std::vector<test::PeopleScore> scores(static_cast<std::size_t>(n));
  {
    std::atomic<std::size_t> next = 0;
    std::vector<std::jthread> threads;
    for (unsigned t = 0; t < std::max(std::thread::hardware_concurrency(), 1U); ++t)
      threads.emplace_back([&] {
        for (std::size_t i = next++; i < scores.size(); i = next++) scores[i] = score_of(i);
      });
  }
  test::PeopleScore all;
  for (const test::PeopleScore& each : scores) all += each;
  return all;
}

/// The same crowds, with one thing changed.
template <class Change>
test::PeopleScore crowds(int n, std::uint64_t seed, Change&& change,
                         test::CrowdOptions (*draw)(std::uint64_t) = test::random_crowd) {
  return sum(n, [&](std::uint64_t i) {
    test::CrowdOptions options = draw(seed + i);
    options.duration = 30;
    change(options);
    return score(options);
  });
}

void synthetic(int n, std::uint64_t seed) {
  row("all kinds", crowds(n, seed, [](test::CrowdOptions&) {}));
  row("laser at 0.18 m", crowds(n, seed, [](test::CrowdOptions& o) { o.laser.height = 0.18; }));
  row("laser at 0.35 m", crowds(n, seed, [](test::CrowdOptions& o) { o.laser.height = 0.35; }));
  row("laser at 0.85 m", crowds(n, seed, [](test::CrowdOptions& o) { o.laser.height = 0.85; }));
  row("nobody stands all the time", crowds(n, seed, [](test::CrowdOptions& o) { o.standing = 0; }));
  row("everybody stands", crowds(n, seed, [](test::CrowdOptions& o) {
        o.standing += o.walkers;
        o.walkers = 0;
      }));
  row("no furniture", crowds(n, seed, [](test::CrowdOptions& o) {
        o.chairs = o.tables = o.poles = o.boxes = o.bins = o.robots = 0;
      }));
  row("no model", crowds(n, seed, [](test::CrowdOptions& o) { o.model = false; }));
  row("modelled walls", crowds(n, seed, [](test::CrowdOptions& o) { o.model = true; }));
}

/// Of the people that only varied crowds have, those that `change` puts in.
void varied(int n, std::uint64_t seed) {
  const auto only = [&](const char* name, auto change) {
    row(name, crowds(
                  n, seed,
                  [&](test::CrowdOptions& o) {
                    o.walkers = o.standing = o.aids = o.seated = o.groups = o.leaning = 0;
                    change(o);
                  },
                  test::varied_crowd));
  };
  row("varied", crowds(
                    n, seed, [](test::CrowdOptions&) {}, test::varied_crowd));
  only("wheelchairs, frames, prams, trolleys", [](test::CrowdOptions& o) { o.aids = 3; });
  only("seated", [](test::CrowdOptions& o) { o.seated = 3; });
  only("groups", [](test::CrowdOptions& o) { o.groups = 2; });
  only("leaning at walls", [](test::CrowdOptions& o) { o.leaning = 3, o.open = false; });
  only("walkers, no odometry",
       [](test::CrowdOptions& o) { o.walkers = 4, o.odometry = o.model = false, o.moving_laser = true; });
}

void depth_camera(int n, std::uint64_t seed, double height, double pitch) {
  const test::PeopleScore all = sum(n, [&](std::uint64_t i) {
    test::DepthRoomOptions options;
    options.seed = seed + i;
    options.height = height, options.pitch = pitch * std::numbers::pi / 180;
    return score(options);
  });
  char name[80];
  std::snprintf(name, sizeof name, "depth camera at %.2f m, %.0f degrees down", height, pitch);
  row(name, all);
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  std::puts(
      "| what | persons' scans | recall | precision | switches a minute, a person's minute | error median, "
      "RMS | "
      "first found median, p90 |\n|---|---|---|---|---|---|---|");
  parhelion::recordings();
  const int n = argc > 1 ? std::atoi(argv[1]) : 20;
  const std::uint64_t seed = argc > 2 ? static_cast<std::uint64_t>(std::atoll(argv[2])) : 900000;
  parhelion::synthetic(n, seed);
  parhelion::varied(n, seed);
  parhelion::depth_camera(n, seed, 0.35, 0);
  parhelion::depth_camera(n, seed, 0.6, 5);
  parhelion::depth_camera(n, seed, 1.2, 15);
}
