#include "program/tile_server.hpp"

#include <Eigen/Core>
#include <filesystem>
#include <string>

#include "dynains/errors.hpp"
#include "io/files.hpp"
#include "support/catch.hpp"
#include "viewer/tileset_writer.hpp"

using dynains::program::TileServer;
using dynains::test::read_text;
using dynains::test::TemporaryFolder;
using dynains::test::write_text;
namespace fs = std::filesystem;

TEST_CASE("The server of a map answers with its page and its files") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(TileServer(folder.path()), dynains::IoError);  // without tiles
  dynains::viewer::TilesetWriter writer(folder.path(), {}, Eigen::Vector3d::Zero(),
                                        Eigen::Vector3d::Ones());
  writer.add({});
  writer.commit();
  const TileServer server(folder.path());
  const auto page = server.answer("/");
  REQUIRE(page);
  CHECK(page->content.rfind("<!DOCTYPE html>", 0) == 0);
  CHECK(page->content.find("{{") == std::string::npos);
  const auto tileset = server.answer("/tileset.json");
  REQUIRE(tileset);
  CHECK(tileset->content == read_text(folder / "tileset.json"));
  const auto tile = server.answer("/tileset/r.pnts");
  REQUIRE(tile);
  CHECK(tile->content == read_text(folder / "tileset/r.pnts"));
}

TEST_CASE("The server of a map answers with nothing else") {
  const TemporaryFolder folder;
  write_text(folder / "report.json", "secret");
  write_text(folder / "tileset/notes.txt", "secret");
  write_text(folder / "tileset/r8.pnts", "secret");
  fs::create_symlink("../report.json", folder / "tileset/r1.pnts");
  fs::create_directory(folder / "tileset/r2.pnts");
  fs::create_symlink("report.json", folder / "tileset.json");
  const TileServer server(folder.path());
  for (const char* path :
       {"", "report.json", "/report.json", "/tileset", "/tileset/", "/tileset/notes.txt",
        "/tileset/r8.pnts", "/tileset/r0.pnts", "/tileset/r1.pnts", "/tileset/r2.pnts",
        "/tileset/../report.json", "/tileset/../tileset/r1.pnts", "//tileset/r.pnts",
        "/tileset/r/../../report.json.pnts", "/../tileset.json", "/tileset.json", "/tileset/.pnts",
        "/tileset/r.pnts/"}) {
    INFO(path);
    CHECK_FALSE(server.answer(path));
  }
  CHECK_FALSE(server.answer(std::string("/tileset/r.pnts\0x", 17)));
}
