#include "tests/unit/scene/mesh_writers.h"

namespace fulcrum::scene::writers {
namespace {

constexpr int kFirstTag = 7, kTagStep = 3;  ///< Gmsh's node numbers need not follow one another.
int Tag(Index v) { return kFirstTag + kTagStep * static_cast<int>(v); }

std::string GmshHead(const char* version, Out* out) {
  *out << "$MeshFormat\n" << version << (out->text() ? " 0 8\n" : " 1 8\n");
  if (!out->text()) {
    out->Put(std::int32_t{1}) << "\n";
  }
  *out << "$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"wall\"\n$EndPhysicalNames\n";
  return {};
}

}  // namespace

std::string Gmsh1(const MeshFile& m) {
  Out out(Out::kText);
  out << "$NOD\n" << std::to_string(m.vertices.size()) << "\n";
  for (Index v = 0; v < m.vertices.size(); ++v) {
    out.Put(Tag(v)).Point(m.vertices[v]).End();
  }
  out << "$ENDNOD\n$ELM\n" << std::to_string(m.tets.size() + 2) << "\n1 15 0 1 1 7\n2 1 0 1 2 7 10\n";
  for (const Tetrahedron& t : m.tets) {
    out << "9 4 1 1 4 ";
    for (const Index v : t) {
      out.Put(Tag(v));
    }
    out.End();
  }
  out << "$ENDELM\n";
  return out.bytes();
}

std::string Gmsh22(const MeshFile& m, Out::Form form) {
  Out out(form);
  GmshHead("2.2", &out);
  out << "$Nodes\n" << std::to_string(m.vertices.size()) << "\n";
  for (Index v = 0; v < m.vertices.size(); ++v) {
    out.Put(Tag(v)).Point(m.vertices[v]).End();
  }
  out << "\n$EndNodes\n$Elements\n" << std::to_string(m.tets.size() + 1) << "\n";
  const auto element = [&](int number, int kind, bool head, int block) {
    if (out.text()) {
      out.Put(number).Put(kind).Put(2).Put(1).Put(1);
      return;
    }
    if (head) {
      out.Put(kind).Put(block).Put(2);
    }
    out.Put(number).Put(1).Put(1);
  };
  element(1, 1, true, 1);
  out.Put(Tag(0)).Put(Tag(1)).End();
  for (std::size_t i = 0; i < m.tets.size(); ++i) {
    element(static_cast<int>(i) + 2, 4, i == 0, static_cast<int>(m.tets.size()));
    for (const Index v : m.tets[i]) {
      out.Put(Tag(v));
    }
    out.End();
  }
  out << "\n$EndElements\n$NodeData\nskipped\n$EndNodeData\n";
  return out.bytes();
}

std::string Gmsh41(const MeshFile& m, Out::Form form) {
  using U = std::uint64_t;
  using I = std::int32_t;
  Out out(form);
  GmshHead("4.1", &out);
  const U n = m.vertices.size();
  // Two blocks of nodes, the first on a parametric curve; two of elements.
  out << "$Nodes\n";
  out.Put(U{2}).Put(n).Put(U{7}).Put(static_cast<U>(Tag(static_cast<Index>(n - 1)))).End();
  out.Put(I{1}).Put(I{1}).Put(I{1}).Put(U{2}).End();
  out.Put(static_cast<U>(Tag(0))).End().Put(static_cast<U>(Tag(1))).End();
  out.Point(m.vertices[0]).Put(0.5).End().Point(m.vertices[1]).Put(0.75).End();
  out.Put(I{3}).Put(I{1}).Put(I{0}).Put(n - 2).End();
  for (Index v = 2; v < n; ++v) {
    out.Put(static_cast<U>(Tag(v))).End();
  }
  for (Index v = 2; v < n; ++v) {
    out.Point(m.vertices[v]).End();
  }
  out << "\n$EndNodes\n$Elements\n";
  const U tets = m.tets.size();
  out.Put(U{2}).Put(tets + 1).Put(U{1}).Put(tets + 1).End();
  out.Put(I{0}).Put(I{1}).Put(I{15}).Put(U{1}).End();
  out.Put(U{1}).Put(static_cast<U>(Tag(0))).End();
  out.Put(I{3}).Put(I{1}).Put(I{4}).Put(tets).End();
  for (U i = 0; i < tets; ++i) {
    out.Put(i + 2);
    for (const Index v : m.tets[i]) {
      out.Put(static_cast<U>(Tag(v)));
    }
    out.End();
  }
  out << "\n$EndElements\n";
  return out.bytes();
}

}  // namespace fulcrum::scene::writers
