// Trains the classifiers of fusion/people on synthetic crowds alone (tests/fusion/people/synthetic_crowd) and
// writes fusion/people/{segment,track,pair}_trees.cpp:
//   train_people FOLDER [crowds] [seed]
// Tracks and pairs are learned on other crowds than segments, as their features contain the segments'
// log-odds.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "tests/bench/boosting.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion {
namespace {

using test::Samples, test::Boosting, test::TrainedTrees;

constexpr double kPairRate = 4, kTrackRate = 4;  // samples a second
constexpr std::size_t kSegmentTrees = 150, kTrackTrees = 240, kPairTrees = 220, kFirstPairTrees = 100;
constexpr double kAtPerson = 0.4;  // m
constexpr double kDuration = 10;   // s, of a crowd
constexpr int kRounds = 3;
constexpr std::uint64_t kOtherCrowds = 5000;  // added to the seed

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

/// Whose a segment is: a person's number, or what it is.
constexpr int kFurniture = -1, kBuilding = -2, kRobot = -3, kNobody = -4;

int owner_of(const test::CrowdScan& scan, std::span<const people::Return> returns,
             const people::Segment& segment) {
  std::map<int, int> votes;
  for (std::uint32_t i = segment.first; i <= segment.last; ++i) {
    const people::Return& each = returns[i];
    const test::Source source = scan.source[each.beam];
    int who = source == test::Source::furniture  ? kFurniture
              : source == test::Source::building ? kBuilding
                                                 : kRobot;
    if (source == test::Source::person)
      who = std::min_element(scan.people.begin(), scan.people.end(), [&](const auto& a, const auto& b) {
              return (a.position - each.p).norm() < (b.position - each.p).norm();
            })->id;
    ++votes[who];
  }
  return std::max_element(votes.begin(), votes.end(),
                          [](const auto& a, const auto& b) { return a.second < b.second; })
      ->first;
}

/// Whose the tracks are: whose segments they held most in about the last second.
class Owners {
 public:
  int of(std::uint32_t track) const {
    const auto found = held_.find(track);
    if (found == held_.end() || found->second.empty()) return kNobody;
    return std::max_element(found->second.begin(), found->second.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
  }
  /// After a scan; `owners`: of its segments.
  void add(const people::PeopleTracker& tracker, std::span<const int> owners, double dt) {
    std::map<std::uint32_t, std::map<int, double>> held;
    for (const people::Track& track : tracker.tracks()) {
      std::map<int, double>& now = held[track.id] = held_[track.id];
      for (auto& [owner, time] : now) time *= std::exp(-dt);
      for (const people::Leg& leg : track.legs) {
        if (track.seen != track.stamp || leg.seen != track.stamp) continue;
        for (std::size_t s = 0; s < owners.size(); ++s)
          if ((tracker.segments()[s].center - track.position() - leg.offset).norm() < 1e-6)
            now[owners[s]] += dt;
      }
    }
    held_.swap(held);
  }

 private:
  std::map<std::uint32_t, std::map<int, double>> held_;
};

/// What is known of a track before a scan.
struct Before {
  int owner = kNobody;
  bool person = false, main = false;  ///< main: of all tracks of its owner the one that should stay
  Duration age;
};

std::vector<Before> tracks_before(const people::PeopleTracker& tracker, const Owners& owners) {
  std::vector<Before> before;
  for (const people::Track& track : tracker.tracks())
    before.push_back({owners.of(track.id), track.person, true, track.seen - track.born});
  for (Before& one : before)
    for (const Before& other : before)
      if (&one != &other && one.owner >= 0 && one.owner == other.owner &&
          std::tuple(one.person, one.age, &other) < std::tuple(other.person, other.age, &one))
        one.main = false;
  return before;
}

/// A person's segment belongs to that person's main track alone; a thing's to a track that was at its place.
bool belongs(const people::PossiblePart& part, const Before& track, int owner) {
  if (track.owner != owner) return false;
  if (owner >= 0) return track.main;
  return part.distance < (owner == kRobot ? 0.4 : 0.2);
}

void add_pairs(const people::PeopleTracker& tracker, std::span<const Before> before,
               std::span<const int> owners, test::Random& random, Samples& samples) {
  for (const people::PossiblePart& part : tracker.parts()) {
    const Before& track = before[part.track];
    if (track.owner == kNobody) continue;
    // Most are things at their places, which are easy.
    const bool things = track.owner < 0 && owners[part.segment] < 0 && !track.person;
    if (things && !random.chance(0.25)) continue;
    samples.add(part.features, belongs(part, track, owners[part.segment]));
  }
}

/// A thing beside a person is none, and a person's track has to be at that person.
void add_tracks(const people::PeopleTracker& tracker, const test::CrowdScan& scan, const Owners& owners,
                double chance, test::Random& random, Samples& samples) {
  for (const people::Track& track : tracker.tracks()) {
    if (track.seen != scan.stamp || !random.chance(chance)) continue;
    const int owner = owners.of(track.id);
    const bool person =
        std::any_of(scan.people.begin(), scan.people.end(), [&](const test::TruePerson& each) {
          return each.id == owner && (each.position - track.position()).norm() < kAtPerson;
        });
    samples.add(track.features, person);
  }
}

struct TrackSamples {
  Samples tracks, pairs;
};

void add_crowd(const test::Crowd& crowd, const people::PeopleOptions& options, test::Random& random,
               TrackSamples& samples) {
  people::PeopleTracker tracker(options);
  people::SegmentedScan segmented;
  Owners track_owners;
  const double dt = crowd.laser.scan_period;
  for (const test::CrowdScan& scan : crowd.scans) {
    const std::vector<Before> before = tracks_before(tracker, track_owners);
    tracker.update(sweep_of(crowd, scan));
    std::vector<int> owners;
    for (const people::Segment& each : segmented.find(sweep_of(crowd, scan)))
      owners.push_back(owner_of(scan, segmented.returns(), each));
    if (random.chance(kPairRate * dt)) add_pairs(tracker, before, owners, random, samples.pairs);
    track_owners.add(tracker, owners, dt);
    add_tracks(tracker, scan, track_owners, kTrackRate * dt, random, samples.tracks);
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

/// Every other one is varied.
std::vector<test::Crowd> make_crowds(std::uint64_t seed, int n) {
  std::vector<test::Crowd> crowds;
  for (int i = 0; i < n; ++i) {
    const std::uint64_t crowd = seed + static_cast<std::uint64_t>(i);
    test::CrowdOptions options = i % 2 == 0 ? test::random_crowd(crowd) : test::varied_crowd(crowd);
    options.duration = kDuration;
    crowds.push_back(make_crowd(options));
  }
  return crowds;
}

TrainedTrees train_segments(int crowds, std::uint64_t seed) {
  const std::vector<test::Crowd> all = make_crowds(seed, crowds + crowds / 5);
  Samples known, held_out;
  for (std::size_t i = 0; i < all.size(); ++i)
    add_segments(all[i], i < static_cast<std::size_t>(crowds) ? known : held_out);
  const TrainedTrees model = Boosting(known).train(kSegmentTrees);
  report("segments, trained on", known, model);
  report("segments, held out", held_out, model);
  return model;
}

/// Pairs by nearness alone: what the first tracks are made with.
TrainedTrees nearness() {
  constexpr auto sigmas = static_cast<std::uint8_t>(people::PairFeature::sigmas);
  TrainedTrees model;
  model.trees.push_back({{sigmas, sigmas, sigmas}, {1, 2, 3}, {2, 1, 0, 0, 0, 0, 0, -3}});
  return model;
}

int train(const std::string& folder, int crowds, std::uint64_t seed) {
  const TrainedTrees segments = train_segments(crowds, seed);
  write(folder + "/segment_trees.cpp", "segment", segments);
  const std::vector<test::Crowd> all = make_crowds(seed + kOtherCrowds, crowds + crowds / 5);
  TrainedTrees tracks, pairs = nearness();
  // The samples depend on what is tracked, so each round goes on from the one before.
  for (int round = 0; round < kRounds; ++round) {
    people::PeopleOptions options;
    // The thresholds in use were chosen with the trees; others give other samples.
    options.min_log_odds_person = 0;
    options.max_log_odds_not_person = -1.5;
    options.min_log_odds_person_unmoved = 0.5;
    options.max_log_odds_not_person_unmoved = -0.5;
    options.segment = segments.view();
    const TrainedTrees last_tracks = tracks, last_pairs = pairs;
    options.track = last_tracks.view();
    options.pair = last_pairs.view();
    test::Random random(seed);
    TrackSamples known, held_out;
    for (std::size_t i = 0; i < all.size(); ++i)
      add_crowd(all[i], options, random, i < static_cast<std::size_t>(crowds) ? known : held_out);
    tracks = Boosting(known.tracks).train(kTrackTrees);
    report("tracks, trained on", known.tracks, tracks);
    report("tracks, held out", held_out.tracks, tracks);
    pairs = Boosting(known.pairs).train(round == kRounds - 1 ? kPairTrees : kFirstPairTrees);
    report("pairs, trained on", known.pairs, pairs);
    report("pairs, held out", held_out.pairs, pairs);
    std::fflush(stdout);
    write(folder + "/track_trees.cpp", "track", tracks);
    write(folder + "/pair_trees.cpp", "pair", pairs);
  }
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
