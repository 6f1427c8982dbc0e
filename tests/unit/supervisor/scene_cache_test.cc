// Compiled scenes are kept until one of their inputs changes.
#include "services/session/supervisor/scene_cache.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "services/base/core/error.h"
#include "tests/unit/supervisor/temporary_folder.h"

namespace fulcrum::supervisor {
namespace {

namespace fs = std::filesystem;

class SceneCacheTest : public ::testing::Test {
 protected:
  SceneCacheTest() {
    request_.library = folder_.path() / "scenes";
    request_.compiler = folder_.path() / "compiler";
    request_.cache = folder_.path() / "cache";
    fs::create_directory(request_.library);
    std::ofstream(request_.library / "one.yaml") << "name: one\nfolders: [../meshes]\nmesh: organ.stl\n";
    fs::create_directory(folder_.path() / "meshes");
    std::ofstream(folder_.path() / "meshes" / "organ.stl") << "solid";
    Program("echo run >> \"$0.runs\"; cp \"$1\" \"$3\"");
  }
  void Program(const std::string& body) const {
    std::ofstream(request_.compiler) << "#!/bin/sh\n" << body << "\n";
    fs::permissions(request_.compiler, fs::perms::owner_all);
  }
  int Runs() const {
    std::ifstream stream(request_.compiler.string() + ".runs");
    int runs = 0;
    for (std::string line; std::getline(stream, line);) ++runs;
    return runs;
  }
  TemporaryFolder folder_;
  SceneRequest request_;
};

TEST_F(SceneCacheTest, CompilesOnceUntilAnInputChanges) {
  request_.name = "one";
  const fs::path first = ResolveScene(request_);
  EXPECT_TRUE(fs::exists(first));
  EXPECT_EQ(ResolveScene(request_), first);
  EXPECT_EQ(Runs(), 1);
  std::ofstream(folder_.path() / "meshes" / "organ.stl") << "solid changed";
  EXPECT_NE(ResolveScene(request_), first);
  EXPECT_EQ(Runs(), 2);
  std::ofstream(request_.library / "one.yaml") << "name: two\n";
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), 3);
}

TEST_F(SceneCacheTest, AMeshInAFolderOfAPlainNameIsAnInput) {
  fs::create_directories(request_.library / "scans");
  std::ofstream(request_.library / "scans" / "liver.stl") << "solid";
  std::ofstream(request_.library / "plain.yaml")
      << "name: plain\norgan:\n  import: {folders: [scans], organ: liver.stl}\n";
  // One scene names the folder, the other one the mesh.
  std::ofstream(request_.library / "mesh.yaml") << "name: mesh\nbase: plain\norgan: {import: {organ: spleen.stl}}\n";
  std::ofstream(request_.library / "scans" / "spleen.stl") << "solid";
  for (const auto& [scene, mesh] : {std::pair("plain", "liver.stl"), std::pair("mesh", "spleen.stl")}) {
    request_.name = scene;
    (void)ResolveScene(request_);
    const int before = Runs();
    (void)ResolveScene(request_);
    EXPECT_EQ(Runs(), before) << scene;
    std::ofstream(request_.library / "scans" / mesh) << "solid changed";
    (void)ResolveScene(request_);
    EXPECT_EQ(Runs(), before + 1) << scene;
  }
}

TEST_F(SceneCacheTest, NamesWithBlanksNeedNoQuotes) {
  for (const char* mesh : {"my liver.obj", "liver (1).stl", "left, right.ply", "two words.stl"}) {
    std::ofstream(folder_.path() / mesh) << "solid";
  }
  std::ofstream(folder_.path() / "my base.yaml") << "name: base\nfixed:\n  - mesh: left, right.ply\n";
  std::ofstream(folder_.path() / "two.yaml")
      << "name: two\nbase: my base.yaml  # below\norgan: {import: {organ: my liver.obj, unit: mm}}\n"
         "bodies:\n  - {mesh: liver (1).stl, name: one}\n  - mesh: two\n      words.stl\n";
  request_.name = (folder_.path() / "two.yaml").string();
  (void)ResolveScene(request_);
  (void)ResolveScene(request_);
  int runs = 1;
  EXPECT_EQ(Runs(), runs);
  for (const char* mesh : {"my liver.obj", "liver (1).stl", "left, right.ply", "two words.stl", "my base.yaml"}) {
    std::ofstream(folder_.path() / mesh, std::ios::app) << "\n# changed";
    (void)ResolveScene(request_);
    EXPECT_EQ(Runs(), ++runs) << mesh;
  }
}

TEST_F(SceneCacheTest, WhatBelongsToAMeshOfTetgenIsAnInput) {
  std::ofstream(request_.library / "tet.yaml") << "name: tet\norgan: {import: {organ: liver.node}}\n";
  for (const char* extension : {"node", "ele", "face"}) {
    std::ofstream(request_.library / (std::string("liver.") + extension)) << "1";
  }
  request_.name = "tet";
  (void)ResolveScene(request_);
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), 1);
  int runs = 1;
  for (const char* extension : {"ele", "face", "node"}) {
    std::ofstream(request_.library / (std::string("liver.") + extension)) << "1 changed";
    (void)ResolveScene(request_);
    EXPECT_EQ(Runs(), ++runs) << extension;
  }
}

TEST_F(SceneCacheTest, ABaseByNameIsAnInput) {
  std::ofstream(folder_.path() / "mine.yaml") << "name: mine\nbase: one  # and more\n";
  request_.name = (folder_.path() / "mine.yaml").string();
  (void)ResolveScene(request_);
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), 1);
  std::ofstream(folder_.path() / "meshes" / "organ.stl") << "solid of the base changed";
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), 2);
}

TEST_F(SceneCacheTest, MaterialsBesideTheSceneItsBasesAndTheShippedAreInputs) {
  const fs::path own = folder_.path() / "own", base = folder_.path() / "base";
  fs::create_directories(own);
  fs::create_directories(base);
  std::ofstream(base / "low.yaml") << "name: low\n";
  std::ofstream(own / "mine.yaml") << "name: mine\nbase: ../base/low.yaml\n";
  request_.name = (own / "mine.yaml").string();
  (void)ResolveScene(request_);
  const int first = Runs();
  (void)ResolveScene(request_);
  EXPECT_EQ(Runs(), first);
  int added = 0;
  for (const fs::path& folder : {own, base, request_.library.parent_path()}) {
    fs::create_directories(folder / "materials");
    std::ofstream(folder / "materials" / "gel.yaml") << "look: fat\n";
    (void)ResolveScene(request_);
    EXPECT_EQ(Runs(), first + ++added) << folder;
  }
}

TEST_F(SceneCacheTest, KeepsTheVersionsThatWereUsedLast) {
  const auto write = [&](const std::string& description) {
    std::ofstream(request_.library / "one.yaml") << "name: one\ndescription: " << description << "\n";
  };
  std::ofstream(request_.library / "one-more.yaml") << "name: one-more\n";
  request_.name = "one-more";
  const fs::path other = ResolveScene(request_);
  request_.name = "one";
  write("often used");
  const fs::path often = ResolveScene(request_);
  fs::path newest;
  for (std::size_t i = 0; i < kKeptVersions + 5; ++i) {
    write("change " + std::to_string(i));
    newest = ResolveScene(request_);
    std::ofstream(newest.string() + ".forecast1") << "forecast";
    std::ofstream(newest.string() + ".part1") << "of an interrupted compilation";
    write("often used");
    EXPECT_EQ(ResolveScene(request_), often);
  }
  EXPECT_EQ(Runs(), static_cast<int>(kKeptVersions) + 7) << "the one in use was not compiled again";
  EXPECT_TRUE(fs::exists(newest));
  EXPECT_TRUE(fs::exists(other)) << "another scene";
  std::size_t scenes = 0, beside = 0;
  for (const auto& entry : fs::directory_iterator(request_.cache)) {
    const std::string extension = entry.path().extension();
    scenes += extension == ".fulcrum" ? 1 : 0;
    beside += extension == ".forecast1" || extension == ".part1" ? 1 : 0;
  }
  EXPECT_EQ(scenes, kKeptVersions + 1);
  EXPECT_EQ(beside, 2 * (kKeptVersions - 1));
}

TEST_F(SceneCacheTest, TimesFromAClockThatWasAheadCountAsTheOldest) {
  request_.name = "one";
  fs::create_directory(request_.cache);
  const auto tomorrow = fs::file_time_type::clock::now() + std::chrono::hours(24);
  for (std::size_t i = 0; i < kKeptVersions; ++i) {
    const fs::path file = request_.cache / ("one-000000000000000" + std::to_string(i) + ".fulcrum");
    std::ofstream(file) << "of a wrong clock";
    fs::last_write_time(file, tomorrow);
  }
  std::vector<fs::path> made;
  for (std::size_t i = 0; i < kKeptVersions; ++i) {
    std::ofstream(request_.library / "one.yaml") << "name: one\ndescription: " << i << "\n";
    made.push_back(ResolveScene(request_));
    for (const fs::path& file : made) EXPECT_TRUE(fs::exists(file)) << "after " << i;
  }
}

TEST_F(SceneCacheTest, CompiledFileIsTakenAsItIs) {
  std::ofstream(folder_.path() / "ready.fulcrum") << "x";
  request_.name = (folder_.path() / "ready.fulcrum").string();
  EXPECT_EQ(ResolveScene(request_), request_.name);
  EXPECT_EQ(Runs(), 0);
}

TEST_F(SceneCacheTest, UnknownNameListsTheShippedOnes) {
  request_.name = "three";
  try {
    (void)ResolveScene(request_);
    FAIL() << "an unknown scene was found";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("one"), std::string::npos) << error.what();
  }
}

TEST_F(SceneCacheTest, APathThatCannotBeReadIsRefusedWithTheReason) {
  const auto refusal = [&](const fs::path& path) {
    request_.name = path.string();
    try {
      (void)ResolveScene(request_);
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string missing = refusal(folder_.path() / "none.yaml");
  EXPECT_NE(missing.find("none.yaml\": No such file"), std::string::npos) << missing;
  EXPECT_EQ(missing.find("/home"), std::string::npos) << missing;
  EXPECT_NE(refusal(folder_.path()).find("is no file"), std::string::npos);
  request_.for_services = true;
  const std::string unseen = refusal(folder_.path() / "none.yaml");
  EXPECT_NE(unseen.find("services do not see /home, /root and /tmp"), std::string::npos) << unseen;
  if (::geteuid() == 0) return;  // Root reads every folder.
  fs::create_directory(folder_.path() / "closed");
  fs::permissions(folder_.path() / "closed", fs::perms::none);
  EXPECT_NE(refusal(folder_.path() / "closed" / "x.yaml").find("Permission denied"), std::string::npos);
  fs::permissions(folder_.path() / "closed", fs::perms::owner_all);
}

TEST_F(SceneCacheTest, CompilersComplaintIsPassedOn) {
  Program("echo \"one.yaml: organ: missing\" >&2; exit 2");
  request_.name = "one";
  try {
    (void)ResolveScene(request_);
    FAIL() << "a scene that does not compile was found";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("one.yaml: organ: missing"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace fulcrum::supervisor
