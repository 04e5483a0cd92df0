// Trains the classifiers of fusion/people on synthetic crowds alone (tests/fusion/people/synthetic_crowd) and
// writes fusion/people/{segment,track}_trees.cpp:
//   train_people FOLDER [crowds] [seed]
// Gradient boosting of oblivious trees (Friedman 2001, Prokhorenkova et al. 2018) with Newton steps.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <numeric>
#include <string>
#include <vector>

#include "fusion/people/people_tracker.hpp"
#include "tests/fusion/people/synthetic_crowd.hpp"

namespace parhelion {
namespace {

using people::Tree;

struct Samples {
  std::size_t features = 0;
  std::vector<float> values;  // row by row
  std::vector<char> label;
  std::size_t size() const { return label.size(); }
  float at(std::size_t i, std::size_t f) const { return values[i * features + f]; }
  template <class Row>
  void add(const Row& row, bool positive) {
    features = row.size();
    values.insert(values.end(), row.begin(), row.end());
    label.push_back(positive ? 1 : 0);
  }
};

struct Model {
  float start = 0;
  std::vector<Tree> trees;
  people::Trees view() const { return {start, trees}; }
};

class Boosting {
 public:
  static constexpr std::size_t kBins = 40;
  static constexpr double kRate = 0.25, kRegularization = 5;

  explicit Boosting(const Samples& samples) : samples_(samples) {
    for (std::size_t f = 0; f < samples.features; ++f) add_thresholds(f);
    bins_.resize(samples.values.size());
    for (std::size_t i = 0; i < samples.size(); ++i) {
      for (std::size_t f = 0; f < samples.features; ++f) {
        const auto& t = thresholds_[f];
        bins_[i * samples.features + f] =
            static_cast<std::uint8_t>(std::lower_bound(t.begin(), t.end(), samples.at(i, f)) - t.begin());
      }
    }
  }

  Model train(std::size_t trees) {
    Model model;
    const double positive = std::accumulate(samples_.label.begin(), samples_.label.end(), 0.0);
    const auto n = static_cast<double>(samples_.size());
    model.start = static_cast<float>(std::log(positive / (n - positive)));
    sum_.assign(samples_.size(), double{model.start});
    for (std::size_t k = 0; k < trees; ++k) model.trees.push_back(grow());
    return model;
  }

 private:
  void add_thresholds(std::size_t f) {
    std::vector<float> all;
    for (std::size_t i = 0; i < samples_.size(); i += 1 + samples_.size() / 20000)
      all.push_back(samples_.at(i, f));
    std::sort(all.begin(), all.end());
    std::vector<float> t;
    for (std::size_t b = 1; b < kBins; ++b) {
      const float value = all[all.size() * b / kBins];
      if (t.empty() || value > t.back()) t.push_back(value);
    }
    thresholds_.push_back(t);
  }

  Tree grow() {
    const std::size_t n = samples_.size();
    std::vector<double> gradient(n), hessian(n);
    for (std::size_t i = 0; i < n; ++i) {
      const double p = 1 / (1 + std::exp(-sum_[i]));
      gradient[i] = samples_.label[i] - p;
      hessian[i] = std::max(p * (1 - p), 1e-6);
    }
    Tree tree;
    std::vector<std::uint8_t> leaf(n, 0);
    for (std::size_t level = 0; level < Tree::kDepth; ++level) split(level, gradient, hessian, leaf, tree);
    double g[1U << Tree::kDepth] = {}, h[1U << Tree::kDepth] = {};
    for (std::size_t i = 0; i < n; ++i) {
      g[leaf[i]] += gradient[i];
      h[leaf[i]] += hessian[i];
    }
    for (std::size_t l = 0; l < tree.leaf.size(); ++l)
      tree.leaf[l] = static_cast<float>(kRate * g[l] / (h[l] + kRegularization));
    for (std::size_t i = 0; i < n; ++i) sum_[i] += double{tree.leaf[leaf[i]]};
    return tree;
  }

  void split(std::size_t level, const std::vector<double>& gradient, const std::vector<double>& hessian,
             std::vector<std::uint8_t>& leaf, Tree& tree) const {
    double best = -1;
    std::size_t best_bin = 0, best_feature = 0;
    const std::size_t leaves = std::size_t{1} << level;
    std::vector<double> g(leaves * kBins), h(leaves * kBins);
    for (std::size_t f = 0; f < samples_.features; ++f) {
      std::fill(g.begin(), g.end(), 0);
      std::fill(h.begin(), h.end(), 0);
      for (std::size_t i = 0; i < samples_.size(); ++i) {
        const std::size_t cell = leaf[i] * kBins + bins_[i * samples_.features + f];
        g[cell] += gradient[i];
        h[cell] += hessian[i];
      }
      for (std::size_t b = 0; b < thresholds_[f].size(); ++b) {
        double gain = 0;
        for (std::size_t l = 0; l < leaves; ++l) {
          double gl = 0, hl = 0, gr = 0, hr = 0;
          for (std::size_t k = 0; k < kBins; ++k) {
            (k <= b ? gl : gr) += g[l * kBins + k];
            (k <= b ? hl : hr) += h[l * kBins + k];
          }
          gain += gl * gl / (hl + kRegularization) + gr * gr / (hr + kRegularization);
        }
        if (gain > best) {
          best = gain;
          best_bin = b;
          best_feature = f;
        }
      }
    }
    tree.feature[level] = static_cast<std::uint8_t>(best_feature);
    tree.threshold[level] = thresholds_[best_feature][best_bin];
    for (std::size_t i = 0; i < samples_.size(); ++i)
      leaf[i] |= static_cast<std::uint8_t>((bins_[i * samples_.features + best_feature] > best_bin ? 1U : 0U)
                                           << level);
  }

  const Samples& samples_;
  std::vector<std::vector<float>> thresholds_;
  std::vector<std::uint8_t> bins_;
  std::vector<double> sum_;
};

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

void report(const char* name, const Samples& test, const Model& model) {
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

std::string number(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", double{value});
  std::string result = text;
  if (result.find_first_of(".e") == std::string::npos) result += ".0";
  return result + "F";
}

void write(const std::string& path, const std::string& name, const Model& model) {
  std::ofstream file(path);
  file << "// Written by tests/bench/train_people.cpp, from synthetic scans alone.\n#include "
          "\"fusion/people/boosted_trees.hpp\"\n\nnamespace parhelion::people {\nnamespace {\n\n// "
          "clang-format "
          "off\nconstexpr Tree kTrees[] = {\n";
  for (const Tree& tree : model.trees) {
    file << "  {{";
    for (std::size_t k = 0; k < Tree::kDepth; ++k) file << (k ? ", " : "") << int{tree.feature[k]};
    file << "}, {";
    for (std::size_t k = 0; k < Tree::kDepth; ++k) file << (k ? ", " : "") << number(tree.threshold[k]);
    file << "},\n   {";
    for (std::size_t k = 0; k < tree.leaf.size(); ++k) file << (k ? ", " : "") << number(tree.leaf[k]);
    file << "}},\n";
  }
  file << "};\n// clang-format on\n\n}  // namespace\n\nTrees " << name << "_trees() { return {"
       << number(model.start) << ", kTrees}; }\n\n}  // namespace parhelion::people\n";
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
  const Model segment_model = Boosting(segments).train(80);
  report("segments, trained on", segments, segment_model);
  report("segments, held out", held_segments, segment_model);
  Model track_model;
  // The tracks depend on which of them are persons, so the second round starts from the first.
  for (int round = 0; round < 2; ++round) {
    people::PeopleOptions options;
    options.segment = segment_model.view();
    const Model previous = track_model;
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
