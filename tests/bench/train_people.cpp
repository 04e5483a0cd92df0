// Trains the classifiers of fusion/people on synthetic crowds alone (tests/fusion/people/synthetic_crowd) and
// writes fusion/people/{segment,track}_trees.cpp:
//   train_people FOLDER [crowds] [seed]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "tests/bench/boosting.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion {
namespace {

using test::Samples, test::Boosting, test::TrainedTrees;

people::LaserSweep sweep_of(const test::Crowd& crowd, const test::CrowdScan& scan) {
  return {0,           scan.scan,  crowd.laser, scan.estimated, crowd.beam_time, scan.building,
          crowd.sigma, scan.stamp, {}};
}

bool is_person(const test::CrowdScan& scan, std::span<const people::Return> returns,
               const people::Segment& segment) {
  int person = 0;
  for (std::uint32_t i = segment.first; i <= segment.last; ++i)
    person += scan.source[returns[i].beam] == test::Source::person ? 1 : 0;
  return 2 * person > static_cast<int>(segment.last - segment.first + 1);
}

void add_segments(const test::Crowd& crowd, Samples& samples) {
  people::SegmentedScan segmented;
  const std::size_t step = static_cast<std::size_t>(0.4 / crowd.laser.scan_period) + 1;
  for (std::size_t k = 0; k < crowd.scans.size(); k += step) {
    const auto segments = segmented.find(sweep_of(crowd, crowd.scans[k]));
    for (const people::Segment& each : segments)
      samples.add(each.features, is_person(crowd.scans[k], segmented.returns(), each));
  }
}

void add_tracks(const test::Crowd& crowd, const people::PeopleOptions& options, test::Random& random,
                Samples& samples) {
  people::PeopleTracker tracker(options);
  for (const test::CrowdScan& scan : crowd.scans) {
    tracker.update(sweep_of(crowd, scan));
    for (const people::Track& track : tracker.tracks()) {
      if (track.seen != scan.stamp || !random.chance(4 * crowd.laser.scan_period)) continue;
      const bool person = std::any_of(
          scan.people.begin(), scan.people.end(),
          [&](const test::TruePerson& each) { return (each.position - track.position()).norm() < 0.3; });
      samples.add(track.features, person);
    }
  }
}

void report(const char* name, const Samples& test, const TrainedTrees& model) {
  std::size_t right = 0, positive = 0, true_positive = 0, called = 0;
  for (std::size_t i = 0; i < test.size(); ++i) {
    const bool yes =
        evaluate(model.view(), std::span(test.values).subspan(i * test.features, test.features)) > 0;
    right += yes == (test.label[i] != 0) ? 1 : 0;
    positive += test.label[i] != 0 ? 1 : 0;
    called += yes ? 1 : 0;
    true_positive += yes && test.label[i] != 0 ? 1 : 0;
  }
  std::printf("%s: %zu samples, %.1f %% positive; right %.2f %%, recall %.3f, precision %.3f\n", name,
              test.size(), 100.0 * positive / test.size(), 100.0 * right / test.size(),
              1.0 * true_positive / positive, 1.0 * true_positive / called);
}

void write(const std::string& path, const std::string& name, const TrainedTrees& model) {
  std::ofstream file(path);
  file << "// Written by tests/bench/train_people.cpp, from synthetic scans alone.\n#include "
          "\"fusion/people/person_trees.hpp\"\n\nnamespace parhelion::people {\nnamespace {\n\n// "
          "clang-format "
          "off\nconstexpr Tree kTrees[] = {\n";
  test::write_trees(file, model.trees);
  file << "};\n// clang-format on\n\n}  // namespace\n\nTrees " << name << "_trees() { return {"
       << test::number_text(model.start) << ", kTrees}; }\n\n}  // namespace parhelion::people\n";
}

int train(const std::string& folder, int crowds, std::uint64_t seed) {
  std::vector<test::Crowd> known, unknown;
  for (int i = 0; i < crowds + crowds / 5; ++i) {
    test::CrowdOptions options = test::random_crowd(seed + static_cast<std::uint64_t>(i));
    options.duration = 20;
    (i < crowds ? known : unknown).push_back(make_crowd(options));
  }
  Samples segments, held_segments;
  for (const test::Crowd& each : known) add_segments(each, segments);
  for (const test::Crowd& each : unknown) add_segments(each, held_segments);
  const TrainedTrees segment_model = Boosting(segments).train(80);
  report("segments, trained on", segments, segment_model);
  report("segments, held out", held_segments, segment_model);
  TrainedTrees track_model;
  // The tracks depend on which of them are persons, so the second round starts from the first.
  for (int round = 0; round < 2; ++round) {
    people::PeopleOptions options;
    options.segment = segment_model.view();
    const TrainedTrees previous = track_model;
    options.track = previous.view();
    test::Random random(seed);
    Samples tracks, held_tracks;
    for (const test::Crowd& each : known) add_tracks(each, options, random, tracks);
    for (const test::Crowd& each : unknown) add_tracks(each, options, random, held_tracks);
    track_model = Boosting(tracks).train(120);
    report("tracks, trained on", tracks, track_model);
    report("tracks, held out", held_tracks, track_model);
  }
  write(folder + "/segment_trees.cpp", "segment", segment_model);
  write(folder + "/track_trees.cpp", "track", track_model);
  return 0;
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: train_people FOLDER [crowds] [seed]\n");
    return 2;
  }
  return parhelion::train(argv[1], argc > 2 ? std::atoi(argv[2]) : 200,
                          argc > 3 ? static_cast<std::uint64_t>(std::atoll(argv[3])) : 1);
}
