// Files that are written as a whole or not at all.
#include "adaptive_bvh/detail/write_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "support/full_disk.h"

namespace adaptive_bvh_test {
namespace write_file_test {

using adaptive_bvh::detail::writeFile;
namespace fs = std::filesystem;

class WriteFile : public testing::Test {
 protected:
  WriteFile() { fs::create_directory(folder_); }
  ~WriteFile() override { fs::remove_all(folder_); }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  static std::string read(const std::string& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
  }
  std::set<std::string> names() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.insert(entry.path().filename().string());
    return names;
  }
  static void write(const std::string& path, const std::string& text) {
    writeFile(path, [&](std::ostream& out) { out << text; });
  }

 private:
  const fs::path folder_ =
      fs::path(testing::TempDir()) / ("adaptive_bvh_write_" + std::to_string(::getpid()));
};

TEST_F(WriteFile, WritesNewFilesAndReplacesOldOnes) {
  write(path("a"), std::string("one\0two\r\n", 9));
  EXPECT_EQ(std::string("one\0two\r\n", 9), read(path("a")));
  fs::permissions(path("a"), fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("a", path("link"));
  write(path("link"), "three");
  EXPECT_EQ("three", read(path("a")));
  EXPECT_TRUE(fs::is_symlink(path("link")));
  EXPECT_EQ(fs::perms::owner_read | fs::perms::owner_write, fs::status(path("a")).permissions());
  EXPECT_EQ((std::set<std::string>{"a", "link"}), names());
}

TEST_F(WriteFile, FollowsLinksToWhatIsNotThereYet) {
  fs::create_directory(path("folder"));
  fs::create_symlink("folder/second", path("first"));
  fs::create_symlink("../new", path("folder/second"));
  for (const char* text : {"one", "two"}) {
    write(path("first"), text);
    EXPECT_EQ(text, read(path("new")));
    EXPECT_TRUE(fs::is_symlink(path("first")) && fs::is_symlink(path("folder/second")));
  }
  fs::create_symlink(fs::absolute(path("new")), path("third"));
  write(path("third"), "three");
  EXPECT_EQ("three", read(path("new")));
  fs::create_symlink("circle", path("circle"));
  EXPECT_THROW(write(path("circle"), "text"), std::system_error);
  EXPECT_TRUE(fs::is_symlink(path("circle")));
}

TEST_F(WriteFile, WritesIntoAPipe) {
  ASSERT_EQ(0, ::mkfifo(path("pipe").c_str(), 0600));
  fs::create_symlink("pipe", path("link"));
  for (const char* name : {"pipe", "link"}) {
    std::string got;
    std::thread reader([&] { got = read(path("pipe")); });
    write(path(name), "through");
    reader.join();
    EXPECT_EQ("through", got);
    EXPECT_TRUE(fs::is_fifo(path("pipe")));
  }
  EXPECT_EQ((std::set<std::string>{"pipe", "link"}), names());
}

TEST_F(WriteFile, LeavesTheOldFileWhenTheDiskIsFull) {
  write(path("a"), "old");
  for (const rlim_t room : {0, 1, 4096, 100000}) {
    const FullDisk full(room);
    for (const char* name : {"a", "new"}) try {
        write(path(name), std::string(200000, 'x'));
        ADD_FAILURE() << "no error for " << name;
      } catch (const std::system_error& error) {
        EXPECT_EQ(std::errc::file_too_large, error.code());
        EXPECT_EQ(0u, std::string(error.what()).find("cannot write '" + path(name) + "': "));
      }
    EXPECT_EQ("old", read(path("a")));
    EXPECT_EQ((std::set<std::string>{"a"}), names());
  }
}

TEST_F(WriteFile, LeavesTheOldFileWhenWritingThrows) {
  write(path("a"), "old");
  const auto fail = [](std::ostream& out) {
    out << std::string(100000, 'x');
    throw std::domain_error("not now");
  };
  EXPECT_THROW(writeFile(path("a"), fail), std::domain_error);
  EXPECT_EQ("old", read(path("a")));
  EXPECT_EQ((std::set<std::string>{"a"}), names());
}

TEST_F(WriteFile, SaysWhy) {
  const auto codeOf = [](const std::string& path) {
    try {
      write(path, "text");
    } catch (const std::system_error& error) {
      return error.code();
    }
    return std::error_code();
  };
  EXPECT_EQ(std::errc::no_such_file_or_directory, codeOf(path("missing/a")));
  EXPECT_EQ(std::errc::is_a_directory, codeOf(path("")));
  fs::create_directory_symlink(".", path("here"));
  EXPECT_EQ(std::errc::is_a_directory, codeOf(path("here")));
  EXPECT_EQ(std::errc::no_space_on_device, codeOf("/dev/full"));
  EXPECT_EQ(std::error_code(), codeOf("/dev/null"));
}

}  // namespace write_file_test
}  // namespace adaptive_bvh_test
