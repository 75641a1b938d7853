// SPDX-License-Identifier: BSD-3-Clause
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file.h"

namespace backlash {
namespace {

namespace fs = std::filesystem;

class FileTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "backlash_file_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    folder_ = name;
  }
  void TearDown() override { fs::remove_all(folder_); }

  static std::string content(const fs::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(FileTest, WritesAndReplacesWithoutLeavingTemporaryFiles) {
  const fs::path path = folder_ / "a.txt";
  write_file(path.string(), "first");
  EXPECT_EQ(content(path), "first");
  write_file(path.string(), std::string("se\0cond", 7));
  EXPECT_EQ(content(path), std::string("se\0cond", 7));
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileTest, KeepsPermissionsAndLinks) {
  const fs::path path = folder_ / "a.txt", link = folder_ / "link";
  write_file(path.string(), "old");
  ASSERT_EQ(::chmod(path.c_str(), 0640), 0);
  fs::create_symlink("a.txt", link);
  write_file(link.string(), "new");
  EXPECT_TRUE(fs::is_symlink(link));
  EXPECT_EQ(content(path), "new");
  EXPECT_EQ(fs::status(path).permissions(), static_cast<fs::perms>(0640));
}

TEST_F(FileTest, RefusesFoldersAndMissingFolders) {
  EXPECT_THROW(write_file(folder_.string(), "x"), CannotWrite);
  EXPECT_THROW(write_file("", "x"), CannotWrite);
  try {
    write_file((folder_ / "none" / "a.txt").string(), "x");
    FAIL() << "wrote into a folder that does not exist";
  } catch (const CannotWrite& error) {
    EXPECT_NE(std::string(error.what()).find("none/a.txt: cannot be written: No such file"),
              std::string::npos)
        << error.what();
  }
  EXPECT_EQ(files(), 0u);
}

TEST_F(FileTest, WritesPipesDirectly) {
  const fs::path path = folder_ / "pipe";
  ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0);
  const int reader = ::open(path.c_str(), O_RDONLY | O_NONBLOCK);
  ASSERT_GE(reader, 0);
  write_file(path.string(), "through");
  char buffer[16] = {};
  EXPECT_EQ(::read(reader, buffer, sizeof buffer), 7);
  EXPECT_STREQ(buffer, "through");
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(path));
}

TEST_F(FileTest, AFullDiskLeavesTheOldFile) {
  const fs::path path = folder_ / "a.txt";
  write_file(path.string(), "old");
  struct rlimit before {};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = ::signal(SIGXFSZ, SIG_IGN);
  struct rlimit small = before;
  small.rlim_cur = 4096;
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  EXPECT_THROW(write_file(path.string(), std::string(100000, 'x')), CannotWrite);
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
  ::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(content(path), "old");
  EXPECT_EQ(files(), 1u);
}

TEST_F(FileTest, OpeningSaysWhatIsMissing) {
  try {
    open_input((folder_ / "none.yaml").string());
    FAIL() << "opened a file that does not exist";
  } catch (const MissingInput& error) {
    EXPECT_NE(std::string(error.what()).find("none.yaml: cannot be opened: No such file"), std::string::npos)
        << error.what();
  }
  try {
    open_input(folder_.string());
    FAIL() << "opened a folder";
  } catch (const MissingInput& error) {
    EXPECT_NE(std::string(error.what()).find("is a directory"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace backlash
