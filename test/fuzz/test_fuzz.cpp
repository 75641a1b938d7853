// SPDX-License-Identifier: BSD-3-Clause
// What scripts/fuzz.sh begins with, and seeded changes of it, through the same functions without libFuzzer: a
// reader that crashes or accepts what it should refuse ends this program.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "backlash_diagnosis/base/random.h"
#include "backlash_diagnosis/base/scratch_folder.h"

// LLVMFuzzerTestOneInput of each fuzzer, renamed by the build.
extern "C" {
int fuzz_csv(const std::uint8_t* data, std::size_t size);
int fuzz_table(const std::uint8_t* data, std::size_t size);
int fuzz_rig(const std::uint8_t* data, std::size_t size);
int fuzz_curve(const std::uint8_t* data, std::size_t size);
int fuzz_recording(const std::uint8_t* data, std::size_t size);
}

namespace backlash {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<std::uint8_t>;

constexpr int kChangesPerSeed = 500;
constexpr std::size_t kLongest = 20'000;  // bytes, as scripts/fuzz.sh

std::vector<Bytes> read_folder(const fs::path& folder) {
  std::vector<Bytes> all;
  for (const auto& entry : fs::directory_iterator(folder)) {
    std::ifstream in(entry.path(), std::ios::binary);
    all.emplace_back(std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>());
  }
  return all;
}

std::size_t place_in(const Bytes& bytes, Random& random) {
  return static_cast<std::size_t>(random.uniform() * static_cast<double>(bytes.size()));
}

/// One to four times a byte changed, put in or taken out, or a stretch repeated or cut off.
Bytes changed(Bytes bytes, Random& random) {
  for (int times = 1 + static_cast<int>(4 * random.uniform()); times > 0 && !bytes.empty(); --times) {
    const auto at = bytes.begin() + static_cast<std::ptrdiff_t>(place_in(bytes, random));
    const auto byte = static_cast<std::uint8_t>(256 * random.uniform());
    switch (static_cast<int>(5 * random.uniform())) {
      case 0:
        *at = byte;
        break;
      case 1:
        bytes.insert(at, byte);
        break;
      case 2:
        bytes.erase(at);
        break;
      case 3: {
        const Bytes tail(at, bytes.end());
        bytes.insert(bytes.end(), tail.begin(), tail.end());
        break;
      }
      default:
        bytes.erase(at, bytes.end());
    }
  }
  if (bytes.size() > kLongest) bytes.resize(kLongest);
  return bytes;
}

class Fuzz : public testing::Test {
 protected:
  void try_all(const std::string& name, int (*input)(const std::uint8_t*, std::size_t)) {
    const std::string root = BACKLASH_DIAGNOSIS_SOURCE_DIR, seeds = folder_.path("seeds");
    const std::string make =
        "/usr/bin/python3 '" + root + "/test/fuzz/seeds.py' '" + root + "/config' '" + seeds + "'";
    ASSERT_EQ(std::system(make.c_str()), 0);
    const std::vector<Bytes> all = read_folder(fs::path(seeds) / name);
    ASSERT_FALSE(all.empty());
    Random random(1);
    for (const Bytes& seed : all) {
      EXPECT_EQ(input(seed.data(), seed.size()), 0);
      for (int i = 0; i < kChangesPerSeed; ++i) {
        const Bytes bytes = changed(seed, random);
        EXPECT_EQ(input(bytes.data(), bytes.size()), 0);
      }
    }
  }

 private:
  ScratchFolder folder_;
};

TEST_F(Fuzz, Csv) {
  try_all("csv", fuzz_csv);
}

TEST_F(Fuzz, Table) {
  try_all("table", fuzz_table);
}

TEST_F(Fuzz, Rig) {
  try_all("rig", fuzz_rig);
}

TEST_F(Fuzz, Curve) {
  try_all("curve", fuzz_curve);
}

TEST_F(Fuzz, Recording) {
  try_all("recording", fuzz_recording);
}

}  // namespace
}  // namespace backlash
