#include <unordered_map>
#include <vector>

#include "services/scene/readers/readers.h"

namespace fulcrum::scene {
namespace {

/// Kinds of element by Gmsh's numbers.
enum Kind : int { kLine = 1, kTriangle = 2, kQuadrangle = 3, kTetrahedron = 4, kLine3 = 8, kPoint = 15 };

class GmshReader {
 public:
  GmshReader(std::string_view bytes, const std::string& name) : in_(bytes, name) {}

  MeshFile Read() {
    for (std::string_view word = in_.Word(); !word.empty(); word = in_.Word()) {
      if (!word.starts_with('$')) {
        in_.Fail(Quote(word) + " where a section ('$...') should begin");
      }
      const std::string section(word.substr(1));
      const std::string end = (section == "NOD" || section == "ELM" ? "$END" : "$End") + section;
      if (section == "MeshFormat") {
        ReadFormat();
      } else if (section == "NOD" || section == "Nodes") {
        CheckVersion(section == "NOD");
        version_ == 4 ? ReadNodes4() : ReadNodes();
      } else if (section == "ELM" || section == "Elements") {
        CheckVersion(section == "ELM");
        version_ == 1   ? ReadElements1()
        : version_ == 4 ? ReadElements4()
        : binary_       ? ReadElements2Binary()
                        : ReadElements2();
      } else {
        in_.SkipPast(end);  // Physical names, entities, data: not needed.
        continue;
      }
      in_.SetText();
      in_.Expect(end);
    }
    return std::move(mesh_);
  }

 private:
  void ReadFormat() {
    const std::string version(in_.Word());
    if (version == "2" || version == "2.0" || version == "2.1" || version == "2.2") {
      version_ = 2;
    } else if (version == "4.1") {
      version_ = 4;
    } else {
      in_.Fail("version " + Quote(version) + "; valid: 1 (which names none), 2.0 to 2.2, 4.1");
    }
    const auto type = in_.Take<int>("the file type");
    if (type != 0 && type != 1) {
      in_.Fail("file type " + std::to_string(type) + "; valid: 0 (ASCII) and 1 (binary)");
    }
    binary_ = type == 1;
    const auto size = in_.Take<int>("the size of a number");
    if (size != 8) {
      in_.Fail("numbers of " + std::to_string(size) + " bytes; valid: 8");
    }
    if (!binary_) {
      return;
    }
    in_.Line();
    in_.SetBinary(false);
    const auto one = in_.Take<std::uint32_t>("the number 1 that shows the byte order");
    if (one != 1 && one != 0x01000000u) {
      in_.Fail(std::to_string(one) + " where the number 1 should show the byte order");
    }
    swap_ = one != 1;
  }

  void CheckVersion(bool is_1) {
    if (is_1) {
      version_ = 1;
    } else if (version_ != 2 && version_ != 4) {
      in_.Fail("this section needs '$MeshFormat' before it");
    }
  }

  /// Switches to binary numbers if the file is binary.
  void BeginData() {
    if (binary_) {
      in_.SetBinary(swap_);
    }
  }

  void AddNode(std::uint64_t tag) {
    if (!ids_.try_emplace(tag, static_cast<Index>(ids_.size())).second) {
      in_.Fail("node " + std::to_string(tag) + " twice");
    }
  }

  void AddVertex() {
    const double x = in_.TakeCoordinate<double>(), y = in_.TakeCoordinate<double>(), z = in_.TakeCoordinate<double>();
    mesh_.vertices.emplace_back(x, y, z);
  }

  // ---------------------------------------------------------------------------------------- versions 1 and 2

  void ReadNodes() {
    const auto count = in_.Take<std::uint64_t>("the number of nodes");
    if (binary_) {
      in_.Line();
    }
    BeginData();
    in_.CheckCount("nodes", count, 4, sizeof(std::int32_t) + 3 * sizeof(double));
    mesh_.vertices.reserve(count);
    for (std::uint64_t i = 0; i < count; ++i) {
      AddNode(static_cast<std::uint64_t>(in_.Take<std::int32_t>("the number of a node")));
      AddVertex();
    }
  }

  void ReadElements1() {
    const std::size_t count = in_.TakeCount<std::uint64_t>("elements", 6, 1);
    for (std::size_t i = 0; i < count; ++i) {
      (void)in_.Take<std::int64_t>("the number of an element");
      const auto kind = in_.Take<int>("the kind of an element");
      const int nodes = NodesOf(kind);
      (void)in_.Take<std::int64_t>("a physical region");
      (void)in_.Take<std::int64_t>("an elementary region");
      const auto written = in_.Take<int>("a number of nodes");
      if (written != nodes) {
        in_.Fail(std::to_string(written) + " nodes in an element of kind " + std::to_string(kind) +
                 "; valid: " + std::to_string(nodes));
      }
      TakeElement<std::int64_t>(kind, nodes);
    }
  }

  void SkipTags(std::int64_t count) {
    if (count < 0) {
      in_.Fail(std::to_string(count) + " tags; valid: 0 and above");
    }
    in_.CheckCount("tags", static_cast<std::uint64_t>(count), 1, sizeof(std::int32_t));
    for (std::int64_t k = 0; k < count; ++k) {
      (void)in_.Take<std::int32_t>("a tag");
    }
  }

  void ReadElements2() {
    const std::size_t count = in_.TakeCount<std::uint64_t>("elements", 4, 1);
    for (std::size_t i = 0; i < count; ++i) {
      (void)in_.Take<std::int64_t>("the number of an element");
      const auto kind = in_.Take<int>("the kind of an element");
      const int nodes = NodesOf(kind);
      SkipTags(in_.Take<int>("a number of tags"));
      TakeElement<std::int64_t>(kind, nodes);
    }
  }

  /// Elements are stored in blocks of one kind.
  void ReadElements2Binary() {
    const auto count = in_.Take<std::uint64_t>("the number of elements");
    in_.Line();
    BeginData();
    in_.CheckCount("elements", count, 1, 2 * sizeof(std::int32_t));
    for (std::uint64_t done = 0; done < count;) {
      const auto kind = in_.Take<std::int32_t>("the kind of a block of elements");
      const int nodes = NodesOf(kind);
      const auto block = in_.Take<std::int32_t>("the number of elements of a block");
      if (block < 1 || static_cast<std::uint64_t>(block) > count - done) {
        in_.Fail("a block of " + std::to_string(block) + " elements; valid: 1 to " + std::to_string(count - done));
      }
      const auto tags = in_.Take<std::int32_t>("the number of tags");
      for (std::int32_t i = 0; i < block; ++i) {
        (void)in_.Take<std::int32_t>("the number of an element");
        SkipTags(tags);
        TakeElement<std::int32_t>(kind, nodes);
      }
      done += static_cast<std::uint64_t>(block);
    }
  }

  // --------------------------------------------------------------------------------------------- version 4.1

  struct Blocks {
    std::size_t blocks, items;
  };

  /// Reads the head of a section; "$Nodes" and "$Elements" have the same one.
  Blocks BeginBlocks(const char* what, std::size_t values_each, std::size_t bytes_each) {
    if (binary_) {
      in_.Line();
    }
    BeginData();
    const std::size_t blocks =
        in_.TakeCount<std::uint64_t>("blocks", 4, 3 * sizeof(std::int32_t) + sizeof(std::uint64_t));
    const std::size_t items = in_.TakeCount<std::uint64_t>(what, values_each, bytes_each);
    (void)in_.Take<std::uint64_t>("the least tag");
    (void)in_.Take<std::uint64_t>("the largest tag");
    return {blocks, items};
  }

  std::size_t TakeBlockSize(std::size_t left) {
    const auto size = in_.Take<std::uint64_t>("the size of a block");
    if (size > left) {
      in_.Fail("a block of " + std::to_string(size) + "; valid: at most the " + std::to_string(left) +
               " that are left of the section's own count");
    }
    return size;
  }

  void EndBlocks(std::size_t left) {
    if (left != 0) {
      in_.Fail("the section's blocks contain " + std::to_string(left) + " fewer than its count");
    }
  }

  void ReadNodes4() {
    auto [blocks, left] = BeginBlocks("nodes", 4, sizeof(std::uint64_t) + 3 * sizeof(double));
    mesh_.vertices.reserve(left);
    for (std::size_t b = 0; b < blocks; ++b) {
      const auto dimension = in_.Take<std::int32_t>("the dimension of an entity");
      (void)in_.Take<std::int32_t>("the tag of an entity");
      const auto parametric = in_.Take<std::int32_t>("a flag (parametric)");
      if (dimension < 0 || dimension > 3) {
        in_.Fail("an entity of dimension " + std::to_string(dimension) + "; valid: 0 to 3");
      }
      const std::size_t size = TakeBlockSize(left);
      for (std::size_t i = 0; i < size; ++i) {
        AddNode(in_.Take<std::uint64_t>("the number of a node"));
      }
      for (std::size_t i = 0; i < size; ++i) {
        AddVertex();
        for (int k = 0; parametric != 0 && k < dimension; ++k) {
          (void)in_.Take<double>("a parametric coordinate");
        }
      }
      left -= size;
    }
    EndBlocks(left);
  }

  void ReadElements4() {
    auto [blocks, left] = BeginBlocks("elements", 2, 2 * sizeof(std::uint64_t));
    for (std::size_t b = 0; b < blocks; ++b) {
      (void)in_.Take<std::int32_t>("the dimension of an entity");
      (void)in_.Take<std::int32_t>("the tag of an entity");
      const auto kind = in_.Take<std::int32_t>("the kind of a block of elements");
      const int nodes = NodesOf(kind);
      const std::size_t size = TakeBlockSize(left);
      for (std::size_t i = 0; i < size; ++i) {
        (void)in_.Take<std::uint64_t>("the number of an element");
        TakeElement<std::uint64_t>(kind, nodes);
      }
      left -= size;
    }
    EndBlocks(left);
  }

  // ------------------------------------------------------------------------------------------------ elements

  int NodesOf(int kind) const {
    switch (kind) {
      case kPoint:
        return 1;
      case kLine:
        return 2;
      case kTriangle:
      case kLine3:
        return 3;
      case kQuadrangle:
      case kTetrahedron:
        return 4;
      default:
        in_.Fail(
            "elements of kind " + std::to_string(kind) +
            "; valid: 1 and 8 (lines), 2 (triangle), 3 (quadrangle), 4 (tetrahedron), 15 (point). Split hexahedra, "
            "prisms and pyramids, and save as first order");
    }
  }

  template <class T>
  void TakeElement(int kind, int nodes) {
    std::array<Index, 4> corners{};
    for (int k = 0; k < nodes; ++k) {
      const auto tag = in_.Take<T>("a node");
      const auto entry = ids_.find(static_cast<std::uint64_t>(tag));
      if (entry == ids_.end() || entry->second >= mesh_.vertices.size()) {
        in_.Fail("node " + std::to_string(tag) + " is none of the " + std::to_string(mesh_.vertices.size()) + " nodes");
      }
      corners[static_cast<std::size_t>(k)] = entry->second;
    }
    if (kind == kTetrahedron) {
      mesh_.tets.push_back(corners);
    } else if (kind == kTriangle || kind == kQuadrangle) {
      AddPolygon(std::span(corners).first(static_cast<std::size_t>(nodes)), in_, &mesh_);
    } else {
      ++mesh_.skipped;
    }
  }

  Cursor in_;
  int version_ = 0;
  bool binary_ = false, swap_ = false;
  std::unordered_map<std::uint64_t, Index> ids_;  ///< For look-ups only, so its order has no effect.
  MeshFile mesh_;
};

}  // namespace

MeshFile ReadGmsh(std::string_view bytes, const std::string& name) { return GmshReader(bytes, name).Read(); }

}  // namespace fulcrum::scene
