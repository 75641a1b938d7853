// SPDX-License-Identifier: BSD-3-Clause
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "backlash_diagnosis/base/error.h"
#include "backlash_diagnosis/base/file_folder.h"

namespace backlash {
namespace {

namespace fs = std::filesystem;

class FileFolderTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string name = (fs::temp_directory_path() / "backlash_folder_XXXXXX").string();
    ASSERT_NE(::mkdtemp(name.data()), nullptr);
    root_ = fs::canonical(name);
    fs::create_directories(root_ / "open" / "sub");
    fs::create_directories(root_ / "openly");  // begins like it and is another one
    std::ofstream(root_ / "secret") << "x";
  }
  void TearDown() override { fs::remove_all(root_); }

  FileFolder folder() const { return {"~folder", (root_ / "open").string()}; }

  fs::path root_;
};

TEST_F(FileFolderTest, PathsInsideAreTakenRelativeAndAbsolute) {
  EXPECT_EQ(folder().inside("out", "a.csv"), (root_ / "open/a.csv").string());
  EXPECT_EQ(folder().inside("out", "sub/../new/b.csv"), (root_ / "open/new/b.csv").string());
  EXPECT_EQ(folder().inside("out", (root_ / "open/sub/c").string()), (root_ / "open/sub/c").string());
  EXPECT_EQ(folder().inside("out", "."), (root_ / "open").string());
}

TEST_F(FileFolderTest, PathsThatLeadOutAreRefusedWithNameValueAndFolder) {
  fs::create_symlink(root_ / "secret", root_ / "open/link");
  fs::create_symlink(root_, root_ / "open/up");
  fs::create_symlink(root_ / "not_there_yet", root_ / "open/dangling");
  for (const std::string& path :
       {std::string("../secret"), std::string("sub/../../secret"), (root_ / "secret").string(),
        std::string("/etc/passwd"), std::string("link"), std::string("up/secret"), std::string("dangling"),
        (root_ / "openly/a").string(), std::string(), std::string("a\0b", 3)}) {
    try {
      FAIL() << path << " was taken as " << folder().inside("train", path);
    } catch (const InvalidParameter& e) {
      EXPECT_EQ(e.name(), "train");
      if (!path.empty() && path.find('\0') == std::string::npos) {
        EXPECT_NE(std::string(e.what()).find(path), std::string::npos);
        EXPECT_NE(std::string(e.what()).find("~folder"), std::string::npos) << e.what();
      }
    }
  }
}

TEST_F(FileFolderTest, ALinkAsFolderIsFollowedOnce) {
  fs::create_symlink(root_ / "open", root_ / "alias");
  const FileFolder alias("~folder", (root_ / "alias/").string());
  EXPECT_EQ(alias.path(), (root_ / "open").string());
  EXPECT_EQ(alias.inside("out", (root_ / "alias/a").string()), (root_ / "open/a").string());
}

TEST_F(FileFolderTest, AFileIsNoFolderAndAMissingOneIsMade) {
  EXPECT_THROW(FileFolder("~folder", (root_ / "secret").string()), InvalidParameter);
  EXPECT_THROW(FileFolder("~folder", ""), InvalidParameter);
  const FileFolder fresh("~folder", (root_ / "a/b").string());
  EXPECT_EQ(fresh.inside("out", "c"), (root_ / "a/b/c").string());
  fresh.create();
  EXPECT_TRUE(fs::is_directory(root_ / "a/b"));
  EXPECT_THROW(FileFolder("~folder", (root_ / "secret/sub").string()).create(), CannotWrite);
}

}  // namespace
}  // namespace backlash
