// Trains the classifier of things on made-up sites alone (tests/mean_sites, with varied things):
//   train_objects samples FIRST LAST > FILE   the things found on the sites of these seeds, a row each
//   train_objects trees FOLDER FILE...        writes kind_trees.cpp; a fifth of the sites is held out
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "fusion/semantic/objects/classify_object.hpp"
#include "fusion/semantic/objects/kind_trees.hpp"
#include "protocols/quantile.hpp"
#include "protocols/splitmix64.hpp"
#include "tests/bench/boosting.hpp"
#include "tests/mean_sites/mean_score.hpp"

namespace parhelion {
namespace {

using semantic::kThings;
constexpr std::size_t kTreesOfEach = 60;

/// Without what is higher than `top` m over the lowest points: as of a device that looks down, or of a crop.
test::MeanScan cropped(const test::MeanScan& scan, float top) {
  std::vector<float> heights;
  for (const Eigen::Vector3f& p : scan.cloud.points) heights.push_back(p.z());
  const float ground = heights.empty() ? 0 : quantile(heights, 0.02);
  test::MeanScan kept;
  kept.T_cloud_site = scan.T_cloud_site;
  kept.cloud.viewpoints = scan.cloud.viewpoints;
  for (std::size_t i = 0; i < scan.cloud.size(); ++i) {
    if (scan.cloud.points[i].z() > ground + top) continue;
    kept.cloud.points.push_back(scan.cloud.points[i]);
    if (!scan.cloud.scans.empty()) kept.cloud.scans.push_back(scan.cloud.scans[i]);
    kept.box.push_back(scan.box[i]);
  }
  return kept;
}

void print_samples(const test::MeanSite& site, test::Device device, std::uint64_t seed) {
  test::MeanScan scan = test::mean_scan(site, device, seed);
  const std::uint64_t draw =
      splitmix64(seed * 64 + static_cast<std::uint64_t>(device) * 8 + static_cast<std::uint64_t>(site.kind));
  if (draw % 3 == 0) scan = cropped(scan, 0.9F + 0.1F * static_cast<float>(draw / 3 % 10));
  semantic::ModelOptions options;
  options.objects.building_too = true;
  const auto built = semantic::build_model(scan.cloud, options);
  if (!built) return;
  const std::vector<std::string> kinds = test::true_kinds(site, scan, *built);
  for (std::size_t o = 0; o < kinds.size(); ++o) {
    if (kinds[o].empty()) continue;
    std::printf("%llu,%s", static_cast<unsigned long long>(seed), kinds[o].c_str());
    for (const float value : built->object_features[o]) std::printf(",%.6g", static_cast<double>(value));
    std::printf("\n");
  }
  std::fflush(stdout);
}

int make_samples(std::uint64_t first, std::uint64_t last) {
  for (std::uint64_t seed = first; seed <= last; ++seed) {
    for (int kind = 0; kind < test::kSiteKinds; ++kind) {
      const test::MeanSite site = test::mean_site(static_cast<test::SiteKind>(kind), seed, true);
      for (int device = 0; device < test::kDevices; ++device)
        print_samples(site, static_cast<test::Device>(device), seed);
    }
  }
  return 0;
}

struct Sample {
  std::uint64_t seed = 0;
  std::size_t thing = 0;  ///< of kThings
  semantic::ObjectFeatures features{};
};

bool read(const std::string& path, std::vector<Sample>& samples) {
  std::ifstream file(path);
  std::string line, field;
  while (std::getline(file, line)) {
    std::istringstream row(line);
    Sample sample;
    if (!std::getline(row, field, ',')) return false;
    sample.seed = std::strtoull(field.c_str(), nullptr, 10);
    std::getline(row, field, ',');
    while (sample.thing < kThings.size() && field != kThings[sample.thing].name) ++sample.thing;
    if (sample.thing == kThings.size()) continue;
    for (float& value : sample.features) {
      if (!std::getline(row, field, ',')) return false;
      value = std::strtof(field.c_str(), nullptr);
    }
    samples.push_back(sample);
  }
  return file.eof();
}

void report(const std::vector<Sample>& samples, const std::vector<test::TrainedTrees>& trees) {
  std::vector<int> count(kThings.size() * kThings.size());
  int right = 0;
  for (const Sample& sample : samples) {
    std::size_t best = 0;
    float max_odds = -1e9F;
    for (std::size_t k = 0; k < trees.size(); ++k) {
      const float odds = evaluate(trees[k].view(), sample.features);
      if (odds > max_odds) max_odds = odds, best = k;
    }
    right += best == sample.thing;
    ++count[sample.thing * kThings.size() + best];
  }
  std::printf("%zu held-out things, %.1f %% right; each row: what these are called\n", samples.size(),
              samples.empty() ? 0 : 100.0 * right / static_cast<double>(samples.size()));
  for (std::size_t k = 0; k < kThings.size(); ++k) {
    std::printf("%-15s", kThings[k].name);
    for (std::size_t j = 0; j < kThings.size(); ++j) {
      if (const int n = count[k * kThings.size() + j]; n > 0) std::printf(" %s: %d", kThings[j].name, n);
    }
    std::printf("\n");
  }
}

void write(const std::string& path, const std::vector<test::TrainedTrees>& trees) {
  std::ofstream file(path);
  file << "// Written by tests/bench/train_objects.cpp, from made-up sites alone.\n"
          "#include \"fusion/semantic/objects/kind_trees.hpp\"\n\n"
          "namespace parhelion::semantic {\nnamespace {\n\n// clang-format off\n";
  for (std::size_t k = 0; k < trees.size(); ++k) {
    file << "constexpr Tree kTrees" << k << "[] = {  // " << kThings[k].name << "\n";
    test::write_trees(file, trees[k].trees);
    file << "};\n";
  }
  file << "constexpr Trees kOfThings[] = {\n";
  for (std::size_t k = 0; k < trees.size(); ++k)
    file << "  {" << test::number_text(trees[k].start) << ", kTrees" << k << "},\n";
  file << "};\n// clang-format on\nstatic_assert(std::size(kOfThings) == kThings.size());\n\n}  // "
          "namespace\n\n"
          "std::span<const Trees> thing_trees() { return kOfThings; }\n\n}  // namespace "
          "parhelion::semantic\n";
}

std::vector<test::TrainedTrees> train(const std::vector<Sample>& samples) {
  std::vector<test::TrainedTrees> trees;
  for (std::size_t k = 0; k < kThings.size(); ++k) {
    test::Samples of_thing;
    for (const Sample& sample : samples) of_thing.add(sample.features, sample.thing == k);
    trees.push_back(test::Boosting(of_thing).train(kTreesOfEach));
  }
  return trees;
}

int make_trees(const std::string& folder, std::span<char*> files) {
  std::vector<Sample> known, held_out;
  for (const char* path : files) {
    std::vector<Sample> all;
    if (!read(path, all)) {
      std::fprintf(stderr, "%s: not written by train_objects samples\n", path);
      return 1;
    }
    for (const Sample& sample : all) (sample.seed % 5 == 0 ? held_out : known).push_back(sample);
  }
  const std::vector<test::TrainedTrees> trees = train(known);
  report(held_out, trees);
  write(folder + "/kind_trees.cpp", trees);
  return 0;
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  if (argc == 4 && std::strcmp(argv[1], "samples") == 0)
    return parhelion::make_samples(std::strtoull(argv[2], nullptr, 10), std::strtoull(argv[3], nullptr, 10));
  if (argc >= 4 && std::strcmp(argv[1], "trees") == 0)
    return parhelion::make_trees(argv[2], std::span(argv + 3, static_cast<std::size_t>(argc - 3)));
  std::fprintf(stderr, "usage: train_objects samples FIRST LAST > FILE | trees FOLDER FILE...\n");
  return 2;
}
