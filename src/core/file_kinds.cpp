#include "file_kinds.hpp"

#include <algorithm>
#include <array>

#include <zlib.h>

namespace pulson {
namespace {

using namespace std::string_view_literals;

struct KnownKind {
  std::string_view mark;
  std::size_t at;  ///< where it stands
  const char* name;
  const char* remedy;
};

constexpr const char* kPicture = "landmarks are needed, which docs/photographs.md says how to place";
constexpr const char* kFromR = "write the landmarks in R: write.csv(two.d.array(A), \"landmarks.csv\") of geomorph";
constexpr const char* kVolume = "landmarks are needed; place them with 3D Slicer and save them as mrk.json";
constexpr const char* kExcel = "save the sheet as csv";

// In this order: where several fit, the first.
constexpr std::array<KnownKind, 32> kKinds = {{
    {"\x89PNG"sv, 0, "an image (png)", kPicture},
    {"\xFF\xD8\xFF"sv, 0, "an image (jpg)", kPicture},
    {"GIF8"sv, 0, "an image (gif)", kPicture},
    {"II*\0"sv, 0, "an image (tif)", kPicture},
    {"MM\0*"sv, 0, "an image (tif)", kPicture},
    {"II+\0"sv, 0, "an image (BigTIFF)", kPicture},
    {"MM\0+"sv, 0, "an image (BigTIFF)", kPicture},
    {"WEBP"sv, 8, "an image (webp)", kPicture},
    {"\0\0\0\x0CjP  "sv, 0, "an image (JPEG 2000)", kPicture},
    {"\xFF\x4F\xFF\x51"sv, 0, "an image (JPEG 2000)", kPicture},
    {"ftypheic"sv, 4, "an image (heic)", kPicture},
    {"ftypheix"sv, 4, "an image (heic)", kPicture},
    {"ftypmif1"sv, 4, "an image (heif)", kPicture},
    {"ftypavif"sv, 4, "an image (avif)", kPicture},
    {"8BPS"sv, 0, "an image (Photoshop)", kPicture},
    {"ftyp"sv, 4, "a video (mp4)", "landmarks of its frames are needed, as DeepLabCut writes them in csv"},
    {"\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"sv, 0, "a document of Office 97 to 2003 (xls, doc)", kExcel},
    {"RDX2\n"sv, 0, "R data", kFromR},
    {"RDX3\n"sv, 0, "R data", kFromR},
    {"RDA3\n"sv, 0, "R data", kFromR},
    {"X\n\0\0\0\2"sv, 0, "R data", kFromR},
    {"X\n\0\0\0\3"sv, 0, "R data", kFromR},
    {"MATLAB 5.0 MAT-file"sv, 0, "a MATLAB file (mat)",
     "write the landmarks in MATLAB: writematrix(X, 'landmarks.csv')"},
    {"\x89HDF\r\n\x1A\n"sv, 0, "an HDF5 file (h5, also mat of version 7.3)",
     "write the landmarks as csv or npy: numpy.save('landmarks.npy', file['landmarks'][:])"},
    {"\x89HDF\r\n\x1A\n"sv, 512, "a MATLAB file (mat, version 7.3)",
     "write the landmarks in MATLAB: writematrix(X, 'landmarks.csv')"},
    {"%PDF-"sv, 0, "a PDF document", "save the table in it as csv"},
    {"DICM"sv, 128, "a DICOM image", kVolume},
    {"\x5C\1\0\0"sv, 0, "a volume (NIfTI)", kVolume},
    {"NRRD000"sv, 0, "a volume (NRRD)", kVolume},
    {"SQLite format 3"sv, 0, "an SQLite database", "export the table as csv"},
    {"PAR1"sv, 0, "a Parquet file", "write the table as csv: pandas.read_parquet(...).to_csv('landmarks.csv')"},
    {"\x80\4\x95"sv, 0, "a pickle of Python", "write the landmarks with numpy.save or as csv"},
}};

struct PackedKind {
  std::string_view part;  ///< of the names in the archive
  const char* name;
  const char* remedy;
};

constexpr std::array<PackedKind, 7> kArchives = {{
    {"xl/worksheets"sv, "an Excel workbook", kExcel},
    {"xl/workbook"sv, "an Excel workbook", kExcel},
    {"word/"sv, "a Word document", "save the table in it as csv"},
    {"ppt/"sv, "a PowerPoint document", "save the table in it as csv"},
    {"opendocument.spreadsheet"sv, "an OpenDocument spreadsheet", kExcel},
    {"opendocument"sv, "an OpenDocument document", "save the table in it as csv"},
    {"Index/Document.iwa"sv, "a document of Numbers or Pages", "export the table as csv"},
}};

FileKind archive_kind(std::string_view bytes) {
  const auto* const found = std::find_if(kArchives.begin(), kArchives.end(), [&](const PackedKind& kind) {
    return bytes.find(kind.part) != std::string_view::npos;
  });
  if (found != kArchives.end()) return {found->name, found->remedy};
  return {"a zip archive", "unpack it, and read a file in it"};
}

/// The first bytes that a file compressed by gzip holds; fewer where it is broken.
std::string unpacked_beginning(std::string_view bytes) {
  constexpr std::size_t kTelling = 1024;
  std::string beginning(kTelling, '\0');
  z_stream stream{};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(std::min<std::size_t>(bytes.size(), 1U << 20U));
  stream.next_out = reinterpret_cast<Bytef*>(beginning.data());
  stream.avail_out = static_cast<uInt>(beginning.size());
  constexpr int kGzip = 16;
  if (inflateInit2(&stream, MAX_WBITS + kGzip) != Z_OK) return {};
  inflate(&stream, Z_SYNC_FLUSH);
  inflateEnd(&stream);
  beginning.resize(kTelling - stream.avail_out);
  return beginning;
}

FileKind gzip_kind(std::string_view bytes) {
  const std::string beginning = unpacked_beginning(bytes);
  if (const auto inner = beginning.starts_with("\x1F\x8B") ? std::nullopt : kind_of_bytes(beginning))
    return {inner->name + ", compressed by gzip", inner->remedy};
  return {"compressed by gzip", "unpack it by gunzip"};
}

}  // namespace

std::optional<FileKind> kind_of_bytes(std::string_view bytes) {
  if (bytes.starts_with("PK\3\4") || bytes.starts_with("PK\5\6")) return archive_kind(bytes);
  if (bytes.starts_with("\x1F\x8B")) return gzip_kind(bytes);
  if (bytes.starts_with("BZh") && bytes.size() > 4 && bytes.substr(4).starts_with("1AY"))
    return FileKind{"compressed by bzip2 (RData of R)", kFromR};
  if (bytes.starts_with("\xFD"
                        "7zXZ"))
    return FileKind{"compressed by xz (RData of R)", kFromR};
  const bool has_zero = bytes.find('\0') != std::string_view::npos;
  if (bytes.starts_with("BM") && has_zero) return FileKind{"an image (bmp)", kPicture};
  const auto* const found = std::find_if(kKinds.begin(), kKinds.end(), [&](const KnownKind& kind) {
    const bool may_be_text = kind.at > 0 && !has_zero;
    return !may_be_text && bytes.size() > kind.at && bytes.substr(kind.at).starts_with(kind.mark);
  });
  if (found == kKinds.end()) return std::nullopt;
  return FileKind{found->name, found->remedy};
}

}  // namespace pulson
