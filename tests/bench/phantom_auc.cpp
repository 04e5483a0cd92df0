// How well a classifier tells injected returns from real ones: windows of 17 neighbouring beams on flat
// surfaces of a recording, as received and as Parhelion would measure the same surface. Trained on the first
// half of the drive, tested on the second; the laser is learned from the first half, too. Area under the ROC
// curve, 0.5 is a coin.
//   phantom_auc LOG.lcm...
#include <algorithm>
#include <cstdio>
#include <opencv2/ml.hpp>
#include <string>
#include <vector>

#include "fusion/scan/laser_learning.hpp"
#include "fusion/scan/range_noise.hpp"
#include "protocols/bus/log_file.hpp"
#include "protocols/channels.hpp"
#include "protocols/codec.hpp"
#include "protocols/robot.hpp"

namespace parhelion {
namespace {

using scan::FlatWindow;
constexpr std::size_t kBeams = FlatWindow::kBeams;
constexpr int kFeatures = 2 * static_cast<int>(kBeams) + 6;

struct Recording {
  LaserDescription laser;
  std::vector<Scan> scans;
};

bool read(const std::string& path, Recording& recording) {
  auto reader = LogReader::open(path);
  while (reader) {
    const auto event = reader->next();
    if (!event) continue;
    if (!event->has_value()) break;
    const Message& message = **event;
    RobotMessage robot;
    Scan scan;
    if (message.channel == channel::kRobot && decode(message.channel, message.payload, robot).ok()) {
      const auto description = parse_robot_description(robot.yaml, path);
      if (description && description->laser) recording.laser = *description->laser;
    } else if (message.channel == channel::kScan && decode(message.channel, message.payload, scan).ok()) {
      recording.scans.push_back(std::move(scan));
    }
  }
  return !recording.scans.empty();
}

/// The largest step of which all ranges of the window are multiples.
float step_of(const Scan& scan, std::size_t first) {
  for (const double step : {0.1, 0.05, 0.02, 0.01, 0.005, 0.004, 0.002, 0.001, 0.00025}) {
    bool all = true;
    for (std::size_t k = 0; k < kBeams && all; ++k) {
      const double range = scan.ranges[first + k];
      all = std::abs(std::remainder(range, step)) < 0.02 * step + 1e-7 * range;
    }
    if (all) return static_cast<float>(std::log10(step));
  }
  return -5;
}

/// Residuals in order and sorted (mm), their sigma and correlation, step, intensity and its spread, range: of
/// one line through all beams, as somebody would fit it who does not know of passes.
void append(const Scan& scan, std::size_t first, LaserDescription laser, cv::Mat& rows) {
  laser.passes = 1;
  const auto fitted = scan::fit_window(scan, laser, first);
  if (!fitted) return;
  const FlatWindow& window = *fitted;
  std::vector<float> row;
  for (const double e : window.residual) row.push_back(static_cast<float>(1e3 * e));
  std::vector<float> sorted = row;
  std::sort(sorted.begin(), sorted.end());
  row.insert(row.end(), sorted.begin(), sorted.end());
  row.push_back(static_cast<float>(1e3 * window.sigma));
  row.push_back(static_cast<float>(window.correlation));
  row.push_back(step_of(scan, first));
  float mean = 0, squares = 0;
  if (scan.intensities.size() == scan.ranges.size()) {
    for (std::size_t k = 0; k < kBeams; ++k) {
      const float value = scan.intensities[first + k];
      mean += value / kBeams;
      squares += value * value / kBeams;
    }
  }
  row.push_back(mean);
  row.push_back(std::sqrt(std::max(0.0F, squares - mean * mean)));
  row.push_back(static_cast<float>(window.range[kBeams / 2]));
  rows.push_back(cv::Mat(row, true).reshape(1, 1));
}

struct Samples {
  cv::Mat real, injected;
};

/// The same surface, injected: each beam is cast at its own time, as the server does it, so that the passes
/// of an interlaced scan see it where the real ones did.
void add_injected(const FlatWindow& window, const Scan& real, std::size_t sequence,
                  const LaserDescription& laser, const scan::FlatnessGate& gate, cv::Mat& rows) {
  Scan scan = real;
  const scan::NoiseKey key{7, sequence};
  for (std::size_t i = window.first; i < window.first + kBeams; ++i) {
    scan.ranges[i] = scan::measure_surface(laser, key, i, static_cast<float>(window.range[i - window.first]),
                                           window.tan_incidence)
                         .range;
    if (scan.intensities.size() != scan.ranges.size()) continue;
    constexpr double reflectivity = 0.5;  // of a body that says nothing else
    scan.intensities[i] = laser.intensity_codes.empty()
                              ? static_cast<float>(laser.intensity_scale * reflectivity)
                              : scan::sample_intensity(laser, key, i);
  }
  const auto fitted = scan::fit_window(scan, laser, window.first);
  // The same selection as of the real ones.
  if (fitted && gate.passes(*fitted)) append(scan, window.first, laser, rows);
}

Samples samples(std::span<const Scan> scans, std::size_t sequence, const LaserDescription& laser,
                const scan::FlatnessGate& gate) {
  Samples result;
  std::vector<std::pair<std::size_t, FlatWindow>> windows;
  for (std::size_t s = 0; s < scans.size(); ++s) {
    for (const FlatWindow& window : scan::flat_windows(scans[s], laser, gate))
      windows.emplace_back(s, window);
  }
  const std::size_t stride = 1 + windows.size() / 6000;
  for (std::size_t i = 0; i < windows.size(); i += stride) {
    const auto& [s, window] = windows[i];
    append(scans[s], window.first, laser, result.real);
    add_injected(window, scans[s], sequence + s, laser, gate, result.injected);
  }
  return result;
}

cv::Ptr<cv::ml::TrainData> train_data(const Samples& samples, int label_type) {
  cv::Mat rows, labels;
  cv::vconcat(samples.real, samples.injected, rows);
  labels = cv::Mat::zeros(rows.rows, 1, label_type);
  labels.rowRange(samples.real.rows, rows.rows).setTo(1);
  return cv::ml::TrainData::create(rows, cv::ml::ROW_SAMPLE, labels);
}

/// Fraction of (injected, real) pairs in the right order (Mann-Whitney).
double auc(const std::vector<float>& real, const std::vector<float>& injected) {
  std::vector<float> sorted = real;
  std::sort(sorted.begin(), sorted.end());
  double wins = 0;
  for (const float score : injected) {
    const auto low = std::lower_bound(sorted.begin(), sorted.end(), score);
    const auto high = std::upper_bound(low, sorted.end(), score);
    wins += static_cast<double>(low - sorted.begin()) + 0.5 * static_cast<double>(high - low);
  }
  return wins / static_cast<double>(real.size()) / static_cast<double>(injected.size());
}

template <class Score>
double auc_of(const Samples& test, const Score& score) {
  const auto all = [&score](const cv::Mat& rows) {
    std::vector<float> scores;
    for (int i = 0; i < rows.rows; ++i) scores.push_back(score(rows.row(i)));
    return scores;
  };
  return auc(all(test.real), all(test.injected));
}

/// Zero mean and unit variance by the training samples; sigma and residuals squared too, for the linear one.
struct Standard {
  cv::Mat mean, deviation;
  explicit Standard(const cv::Mat& rows) {
    for (int c = 0; c < rows.cols; ++c) {
      cv::Scalar m, d;
      cv::meanStdDev(rows.col(c), m, d);
      mean.push_back(static_cast<float>(m[0]));
      deviation.push_back(static_cast<float>(std::max(d[0], 1e-6)));
    }
    mean = mean.reshape(1, 1);
    deviation = deviation.reshape(1, 1);
  }
  cv::Mat operator()(const cv::Mat& rows) const {
    cv::Mat out = rows.clone();
    for (int i = 0; i < rows.rows; ++i) out.row(i) = (rows.row(i) - mean) / deviation;
    cv::Mat squares;
    cv::multiply(out, out, squares);
    cv::hconcat(out, squares, out);
    return out;
  }
};

double logistic(const Samples& train, const Samples& test) {
  cv::Mat rows;
  cv::vconcat(train.real, train.injected, rows);
  const Standard standard(rows);
  const Samples scaled{standard(train.real), standard(train.injected)};
  auto model = cv::ml::LogisticRegression::create();
  model->setLearningRate(0.1);
  model->setIterations(600);
  model->setRegularization(cv::ml::LogisticRegression::REG_L2);
  model->setTrainMethod(cv::ml::LogisticRegression::BATCH);
  model->train(train_data(scaled, CV_32F));
  const cv::Mat theta = model->get_learnt_thetas();
  return auc_of({standard(test.real), standard(test.injected)}, [&theta](const cv::Mat& row) {
    return static_cast<float>(row.dot(theta.colRange(1, theta.cols)));
  });
}

double boosted(const Samples& train, const Samples& test) {
  auto model = cv::ml::Boost::create();
  model->setBoostType(cv::ml::Boost::GENTLE);
  model->setWeakCount(150);
  model->setMaxDepth(3);
  model->setWeightTrimRate(0.95);
  model->train(train_data(train, CV_32S));
  return auc_of(test, [&model](const cv::Mat& row) {
    return model->predict(row, cv::noArray(), cv::ml::StatModel::RAW_OUTPUT);
  });
}

double worst_of(const Recording& recording, const LaserDescription& laser, const scan::FlatnessGate& gate) {
  const std::size_t half = recording.scans.size() / 2;
  const std::span<const Scan> all = recording.scans;
  const Samples train = samples(all.first(half), 0, laser, gate);
  const Samples test = samples(all.subspan(half), half, laser, gate);
  if (std::min({train.real.rows, train.injected.rows, test.real.rows, test.injected.rows}) < 50) return -1;
  const double linear = logistic(train, test), trees = boosted(train, test);
  std::printf("    %d + %d windows: logistic regression %.3f, boosted trees %.3f\n", train.real.rows,
              test.real.rows, linear, trees);
  // A classifier that is wrong more often than a coin knows as much.
  return std::max({linear, 1 - linear, trees, 1 - trees});
}

int run(const std::string& path) {
  Recording recording;
  if (!read(path, recording)) {
    std::fprintf(stderr, "%s: no scans\n", path.c_str());
    return 1;
  }
  const std::span<const Scan> train = std::span(recording.scans).first(recording.scans.size() / 2);
  const scan::FlatnessGate gate(train, recording.laser);
  const auto learned = scan::learn_laser(train, recording.laser);
  std::printf("%s: %zu scans\n", path.c_str(), recording.scans.size());
  const double preset = worst_of(recording, recording.laser, gate);
  if (!learned) {
    std::printf("  %s\n", learned.error().message.c_str());
    return 1;
  }
  const RangeNoise& noise = learned->noise;
  std::printf("  learned: step %.2f mm, sigma", 1e3 * learned->quantization);
  for (const double sigma : noise.sigma) std::printf(" %.2f", 1e3 * sigma);
  std::printf(" mm, incidence %.2f mm, spread %.2f, correlation %.2f, dropout %.4f, %zu intensity codes\n",
              1e3 * noise.incidence, noise.spread, noise.correlation, noise.dropout,
              learned->intensity_codes.size());
  const double after = worst_of(recording, scan::with_learned(recording.laser, *learned), gate);
  std::printf("  AUC with the preset %.3f, after calibrate %.3f\n", preset, after);
  return 0;
}

}  // namespace
}  // namespace parhelion

int main(int argc, char** argv) {
  int failed = argc < 2 ? 1 : 0;
  for (int i = 1; i < argc; ++i) failed |= parhelion::run(argv[i]);
  return failed;
}
