// The mesh of files.h in VTK's XML, however that may be written.
#pragma once
#include <zlib.h>

#include <cstdint>
#include <sstream>

#include "mesh/files.h"

namespace penalty::testing {

struct VtkXmlForm {
  std::string format = "ascii";  // or "binary", "appended"
  bool raw = false;              // appended as it is, not in base64
  bool compressed = false;
  std::size_t block = 64;  // [bytes]
  bool big_endian = false, long_headers = false;
  bool one_stream = false;  // headers and data encoded together, as VTK itself does with plain data
};

inline std::string base64(const std::string& bytes) {
  static constexpr char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k)
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += i + k > bytes.size() ? '=' : digits[bits >> (18 - 6 * k) & 63];
  }
  return text;
}

/// Writes arrays one after the other.
class VtkXmlWriter {
 public:
  explicit VtkXmlWriter(VtkXmlForm form) : form_(std::move(form)) {}

  template <class T>
  std::string array(const std::string& attributes, const std::vector<T>& values) {
    std::string tag = "<DataArray " + attributes + " format=\"" + form_.format + "\"";
    if (form_.format == "ascii") {
      std::ostringstream text;
      for (const T value : values) text << +value << ' ';
      return tag + ">\n" + text.str() + "\n</DataArray>\n";
    }
    std::string bytes;
    for (const T value : values) bytes += ordered(value);
    const std::string data = encoded(bytes);
    if (form_.format == "binary") return tag + ">\n  " + data + "\n</DataArray>\n";
    tag += " offset=\"" + std::to_string(appended_.size()) + "\"/>\n";
    appended_ += data;
    return tag;
  }

  std::string file(const std::string& pieces) const {
    std::string text = "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"";
    text += form_.big_endian ? "BigEndian\"" : "LittleEndian\"";
    if (form_.long_headers) text += " header_type=\"UInt64\"";
    if (form_.compressed) text += " compressor=\"vtkZLibDataCompressor\"";
    text += ">\n<!-- two tetrahedra -->\n<UnstructuredGrid>\n" + pieces + "</UnstructuredGrid>\n";
    if (!appended_.empty())
      text += std::string("<AppendedData encoding=\"") + (form_.raw ? "raw" : "base64") + "\">\n _" + appended_ +
              "\n</AppendedData>\n";
    return text + "</VTKFile>\n";
  }

 private:
  template <class T>
  std::string ordered(T value) const {
    std::string bytes = big_endian(value);
    if (!form_.big_endian) bytes.assign(bytes.rbegin(), bytes.rend());
    return bytes;
  }
  std::string header(std::uint64_t value) const {
    return form_.long_headers ? ordered(value) : ordered(static_cast<std::uint32_t>(value));
  }
  std::string encoded(const std::string& bytes) const {
    std::string head, data;
    if (form_.compressed) {
      const std::size_t whole = bytes.size() / form_.block, rest = bytes.size() % form_.block;
      head = header(whole + (rest > 0 ? 1 : 0)) + header(form_.block) + header(rest);
      for (std::size_t begin = 0; begin < bytes.size(); begin += form_.block) {
        const std::string block = bytes.substr(begin, form_.block);
        std::string packed(compressBound(block.size()), '\0');
        uLongf size = packed.size();
        compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(block.data()),
                 block.size());
        head += header(size);
        data += packed.substr(0, size);
      }
    } else {
      head = header(bytes.size());
      data = bytes;
    }
    if (form_.format == "appended" && form_.raw) return head + data;
    return form_.one_stream ? base64(head + data) : base64(head) + base64(data);
  }

  VtkXmlForm form_;
  std::string appended_;
};

inline std::string vtk_xml(const VtkXmlForm& form = {}) {
  VtkXmlWriter writer(form);
  const TetMesh mesh = two_tetrahedra();
  const std::vector<double> coordinates(mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size());
  std::string piece = "<Piece NumberOfPoints=\"5\" NumberOfCells=\"3\">\n<PointData>\n";
  piece += writer.array("type=\"UInt8\" Name=\"fixed\"", std::vector<std::uint8_t>{0, 0, 1, 0, 7});
  piece += "</PointData>\n<CellData>\n";
  piece +=
      writer.array("type=\"Int32\" Name=\"material id\" NumberOfComponents=\"1\"", std::vector<std::int32_t>{4, 2, -1});
  piece += writer.array("type=\"Float32\" Name=\"flow\" NumberOfComponents=\"3\"", std::vector<float>(9, 1));
  piece += "</CellData>\n<Points>\n";
  piece += writer.array("type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\"", coordinates);
  piece += "</Points>\n<Cells>\n";
  piece +=
      writer.array("type=\"Int64\" Name=\"connectivity\"", std::vector<std::int64_t>{0, 1, 2, 3, 0, 1, 2, 0, 2, 1, 4});
  piece += writer.array("type=\"Int32\" Name=\"offsets\"", std::vector<std::int32_t>{4, 7, 11});
  piece += writer.array("type=\"UInt8\" Name=\"types\"", std::vector<std::uint8_t>{10, 5, 10});
  return writer.file(piece + "</Cells>\n</Piece>\n");
}

/// Every way in which this reader takes it.
inline std::vector<VtkXmlForm> vtk_xml_forms() {
  std::vector<VtkXmlForm> forms{{}};
  for (const bool compressed : {false, true})
    for (const bool big_endian : {false, true})
      for (const bool long_headers : {false, true}) {
        VtkXmlForm form;
        form.compressed = compressed;
        form.big_endian = big_endian;
        form.long_headers = long_headers;
        form.block = long_headers ? 1000 : 24;
        form.format = "binary";
        forms.push_back(form);
        form.one_stream = true;
        forms.push_back(form);
        form.format = "appended";
        forms.push_back(form);
        form.one_stream = false;
        forms.push_back(form);
        form.raw = true;
        forms.push_back(form);
      }
  return forms;
}

}  // namespace penalty::testing
