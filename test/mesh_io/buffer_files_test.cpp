// The files of glTF buffers: only those in the folder of the document or below it, whatever the
// names and links are, unless the caller wants more.
#include "adaptive_bvh/mesh_io.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "support/bytes.h"

namespace adaptive_bvh_test {
namespace buffer_files_test {

namespace fs = std::filesystem;

constexpr const char* kOutside = "not in its folder or below it";

/// Folders `models` and `elsewhere`, each with a buffer.
class BufferFiles : public testing::Test {
 protected:
  BufferFiles() {
    fs::create_directories(models_ / "below");
    fs::create_directories(elsewhere_);
    for (const char* name :
         {"models/a.bin", "models/below/b.bin", "models/gr\xC3\xBC\xC3\x9F e.bin",
          "models/100%25.bin", "models/..a.bin", "elsewhere/c.bin", "models_too.bin"})
      write(root_ / name, triangle());
  }
  ~BufferFiles() override { fs::remove_all(root_); }

  static std::string triangle() {
    std::string bytes;
    for (const float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f}) put(bytes, x);
    return bytes;
  }
  static void write(const fs::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
  }
  static std::string document(const std::string& uri) {
    return R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
           R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],)"
           R"("bufferViews":[{"buffer":0,"byteLength":36}],"buffers":[{"uri":")" +
           uri + "\"}]}";
  }

  static std::string reasonOf(const fs::path& path, bool anywhere = false) {
    adaptive_bvh::MeshLoadOptions options;
    options.buffers_outside_folder = anywhere;
    try {
      EXPECT_EQ(1u, adaptive_bvh::loadMesh(path.string(), options).triangles.size());
      return "";
    } catch (const adaptive_bvh::MeshLoadError& error) {
      return error.what();
    }
  }

  /// Why a document in `models` with such a buffer is refused.
  std::string refusal(const std::string& uri, bool anywhere = false) const {
    write(models_ / "scene.gltf", document(uri));
    return reasonOf(models_ / "scene.gltf", anywhere);
  }

  void expectOutside(const std::string& uri) const {
    EXPECT_NE(std::string::npos, refusal(uri).find(kOutside)) << uri << ": " << refusal(uri);
  }

  const fs::path root_ = fs::canonical(testing::TempDir()) /
                         ("adaptive_bvh_buffers_" + std::to_string(::getpid())),
                 models_ = root_ / "models", elsewhere_ = root_ / "elsewhere";
};

TEST_F(BufferFiles, InTheFolderOrBelowAreRead) {
  for (const char* uri : {"a.bin", "./a.bin", "below/b.bin", "below/../a.bin", "%61.bin",
                          "below%2Fb.bin", ".//a.bin", "..a.bin", "gr\xC3\xBC\xC3\x9F e.bin",
                          "gr%C3%BC%C3%9F%20e.bin", "gr\\u00fc\\u00df e.bin", "100%2525.bin"})
    EXPECT_EQ("", refusal(uri)) << uri;
}

TEST_F(BufferFiles, OutsideOfTheFolderAreRefused) {
  const std::string outside = (elsewhere_ / "c.bin").string();
  for (const std::string& uri :
       {std::string("../elsewhere/c.bin"), std::string("%2e%2e/elsewhere/c.bin"),
        std::string("..%2Felsewhere%2fc.bin"), std::string("%2E%2E%2Felsewhere%2Fc.bin"),
        std::string("below/../../elsewhere/c.bin"), std::string("./../elsewhere/c.bin"),
        std::string("..//elsewhere/c.bin"), std::string("../models_too.bin"),
        std::string("../models/a.bin"), std::string("../../../../../../etc/passwd"),
        std::string("../nowhere"), std::string(".."), std::string("/etc/passwd"),
        std::string("%2Fetc%2Fpasswd"), std::string("//etc/passwd"), outside,
        (models_ / "a.bin").string()})
    expectOutside(uri);
  for (const char* uri : {"file:///etc/passwd", "%252e%252e/elsewhere/c.bin", "..\\\\elsewhere",
                          "%ZZ/a.bin", "nowhere.bin", "a.bin/b", "?a.bin"})
    EXPECT_NE(std::string::npos, refusal(uri).find("does not exist")) << uri << refusal(uri);
  for (const char* uri : {"below", ".", "a.bin%00", "a.bin%00/../../x"})
    EXPECT_NE("", refusal(uri)) << uri;
}

TEST_F(BufferFiles, OutsideOfTheFolderAreReadWhenTheCallerWantsThem) {
  for (const std::string& uri :
       {std::string("../elsewhere/c.bin"), std::string("a.bin"),
        std::string("%2e%2e/elsewhere/c.bin"), (elsewhere_ / "c.bin").string()})
    EXPECT_EQ("", refusal(uri, true)) << uri;
  EXPECT_NE(std::string::npos, refusal("../nowhere", true).find("does not exist"));
  EXPECT_NE(std::string::npos, refusal("/dev/zero", true).find("no regular file"));
}

TEST_F(BufferFiles, LinksMustStayInTheFolder) {
  fs::create_symlink("a.bin", models_ / "inside");
  fs::create_symlink("below", models_ / "folder");
  fs::create_symlink("../elsewhere/c.bin", models_ / "file");
  fs::create_directory_symlink("../elsewhere", models_ / "way_out");
  EXPECT_EQ("", refusal("inside"));
  EXPECT_EQ("", refusal("folder/b.bin"));
  for (const char* uri : {"file", "way_out/c.bin", "way_out/../elsewhere/c.bin"}) {
    expectOutside(uri);
    EXPECT_EQ("", refusal(uri, true)) << uri;
  }
}

/// As workspaces of links have it: a document and its buffer lead to the same folder.
TEST_F(BufferFiles, ADocumentThatIsALinkHasTheFolderThatItLeadsTo) {
  write(models_ / "scene.gltf", document("a.bin"));
  fs::create_symlink(models_ / "scene.gltf", elsewhere_ / "scene.gltf");
  fs::create_symlink(models_ / "a.bin", elsewhere_ / "a.bin");
  EXPECT_EQ("", reasonOf(elsewhere_ / "scene.gltf"));
  fs::remove(elsewhere_ / "a.bin");
  write(elsewhere_ / "a.bin", triangle());
  EXPECT_EQ("", reasonOf(elsewhere_ / "scene.gltf"));
  fs::remove(elsewhere_ / "a.bin");
  fs::create_symlink(root_ / "models_too.bin", elsewhere_ / "a.bin");
  EXPECT_NE(std::string::npos, reasonOf(elsewhere_ / "scene.gltf").find(kOutside));
}

TEST_F(BufferFiles, AreFoundFromTheFolderOfTheProgram) {
  write(models_ / "scene.gltf", document("a.bin"));
  const fs::path before = fs::current_path();
  fs::current_path(models_);
  EXPECT_EQ("", reasonOf("scene.gltf"));
  EXPECT_EQ("", reasonOf("below/../scene.gltf"));
  fs::current_path(models_ / "below");
  EXPECT_EQ("", reasonOf("../scene.gltf"));
  fs::current_path(before);
}

TEST_F(BufferFiles, ThatAreNotUsedNeedNotExist) {
  std::string json = document("a.bin");
  json.insert(json.rfind(']'), R"(,{"uri":"../nowhere"},{"uri":"/etc/shadow"})");
  write(models_ / "scene.gltf", json);
  EXPECT_EQ("", reasonOf(models_ / "scene.gltf"));
}

}  // namespace buffer_files_test
}  // namespace adaptive_bvh_test
