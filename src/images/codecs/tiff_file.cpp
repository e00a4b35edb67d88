// By libtiff, which takes a file in memory as functions that read, write and seek.

#include "tiff_file.hpp"

#include <algorithm>
#include <cstring>
#include <optional>

namespace pulson::images {
namespace {

MemoryFile& file_of(thandle_t handle) { return *static_cast<MemoryFile*>(handle); }

tmsize_t read_part(thandle_t handle, void* to, tmsize_t count) {
  MemoryFile& file = file_of(handle);
  const std::size_t start = std::min(file.position, file.size());
  const std::size_t taken = std::min(static_cast<std::size_t>(count), file.size() - start);
  std::memcpy(to, (file.written.empty() ? file.bytes.data() : file.written.data()) + start, taken);
  file.position = start + taken;
  return static_cast<tmsize_t>(taken);
}

tmsize_t write_part(thandle_t handle, void* from, tmsize_t count) {
  MemoryFile& file = file_of(handle);
  const auto size = static_cast<std::size_t>(count);
  file.written.resize(std::max(file.written.size(), file.position + size));
  std::memcpy(file.written.data() + file.position, from, size);
  file.position += size;
  return count;
}

toff_t seek_part(thandle_t handle, toff_t offset, int origin) {
  MemoryFile& file = file_of(handle);
  if (origin == SEEK_CUR) offset += file.position;
  if (origin == SEEK_END) offset += file.size();
  file.position = static_cast<std::size_t>(offset);
  return offset;
}

int close_file(thandle_t /*handle*/) { return 0; }

toff_t size_of_file(thandle_t handle) { return file_of(handle).size(); }

/// Nothing is printed.
int ignore(TIFF* /*tif*/, void* /*data*/, const char* /*module*/, const char* /*format*/, va_list /*values*/) {
  return 1;
}

}  // namespace

Tiff open_tiff(MemoryFile& file, const char* mode, tmsize_t most) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), ignore, nullptr);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), ignore, nullptr);
  TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), most);
  return {TIFFClientOpenExt("", mode, &file, read_part, write_part, seek_part, close_file, size_of_file, nullptr,
                            nullptr, options.get()),
          &TIFFClose};
}

namespace {

/// Bytes of a number of this type in memory; 0 for types that are not copied: places in the file, and fractions, which
/// libtiff rounds.
std::size_t size_of(TIFFDataType type) {
  switch (type) {
    case TIFF_BYTE:
    case TIFF_SBYTE:
    case TIFF_ASCII:
    case TIFF_UNDEFINED:
      return 1;
    case TIFF_SHORT:
    case TIFF_SSHORT:
      return 2;
    case TIFF_LONG:
    case TIFF_SLONG:
    case TIFF_FLOAT:
      return 4;
    case TIFF_DOUBLE:
    case TIFF_LONG8:
    case TIFF_SLONG8:
      return 8;
    default:
      return 0;
  }
}

/// Tags of which a page has members of its own, and those that are of the file's pixels as they were packed or of
/// places in it.
bool is_of_file(std::uint32_t tag) {
  static constexpr std::uint32_t kOfFile[] = {
      TIFFTAG_IMAGEDESCRIPTION, TIFFTAG_ICCPROFILE, TIFFTAG_JPEGTABLES,         TIFFTAG_SUBIFD,
      TIFFTAG_EXIFIFD,          TIFFTAG_GPSIFD,     TIFFTAG_INTEROPERABILITYIFD};
  return std::find(std::begin(kOfFile), std::end(kOfFile), tag) != std::end(kOfFile);
}

std::optional<TiffTag> read_tag(TIFF* tif, std::uint32_t tag) {
  const TIFFField* const known = TIFFFieldWithTag(tif, tag);
  if (known == nullptr || is_of_file(tag)) return std::nullopt;
  const TIFFDataType type = TIFFFieldDataType(known);
  const std::size_t size = size_of(type);
  const char* data = nullptr;
  std::size_t count = 0;
  if (TIFFFieldPassCount(known) != 0) {
    std::uint32_t wide = 0;
    std::uint16_t narrow = 0;
    const bool is_wide = TIFFFieldReadCount(known) == TIFF_VARIABLE2;
    if ((is_wide ? TIFFGetField(tif, tag, &wide, &data) : TIFFGetField(tif, tag, &narrow, &data)) != 1)
      return std::nullopt;
    count = is_wide ? wide : narrow;
  } else if (type == TIFF_ASCII && TIFFGetField(tif, tag, &data) == 1 && data != nullptr) {
    count = std::strlen(data) + 1;
  }
  if (size == 0 || count == 0 || data == nullptr) return std::nullopt;
  return TiffTag{tag, static_cast<int>(type), std::string(data, size * count)};
}

std::optional<Resolution> resolution_of(TIFF* tif) {
  float x = 0, y = 0;
  if (TIFFGetField(tif, TIFFTAG_XRESOLUTION, &x) != 1 || TIFFGetField(tif, TIFFTAG_YRESOLUTION, &y) != 1)
    return std::nullopt;
  const auto unit = field<std::uint16_t>(tif, TIFFTAG_RESOLUTIONUNIT);
  using enum Resolution::Unit;
  return Resolution{x, y, unit == RESUNIT_NONE ? kNone : (unit == RESUNIT_CENTIMETER ? kCentimetre : kInch)};
}

}  // namespace

void read_tags(TIFF* tif, PageMetadata& about) {
  about.resolution = resolution_of(tif);
  std::uint16_t planar = PLANARCONFIG_CONTIG, compression = 0;
  about.has_planes = TIFFGetField(tif, TIFFTAG_PLANARCONFIG, &planar) == 1 && planar == PLANARCONFIG_SEPARATE;
  if (TIFFGetField(tif, TIFFTAG_COMPRESSION, &compression) == 1) about.compression = compression;
  const auto orientation = field<std::uint16_t>(tif, TIFFTAG_ORIENTATION);
  about.orientation = orientation >= 1 && orientation <= 8 ? orientation : 1;
  const char* text = nullptr;
  if (TIFFGetField(tif, TIFFTAG_IMAGEDESCRIPTION, &text) == 1 && text != nullptr) about.description = text;
  std::uint32_t size = 0;
  const char* profile = nullptr;
  if (TIFFGetField(tif, TIFFTAG_ICCPROFILE, &size, &profile) == 1) about.profile.assign(profile, size);
  for (int i = 0; i < TIFFGetTagListCount(tif); ++i)
    if (std::optional<TiffTag> tag = read_tag(tif, TIFFGetTagListEntry(tif, i)))
      about.tiff_tags.push_back(std::move(*tag));
}

namespace {

void write_tag(TIFF* tif, const TiffTag& tag) {
  const auto type = static_cast<TIFFDataType>(tag.type);
  if (TIFFFindField(tif, tag.tag, TIFF_ANY) == nullptr) {
    static char name[] = "tag";
    const TIFFFieldInfo unknown{tag.tag, TIFF_VARIABLE2, TIFF_VARIABLE2, type, FIELD_CUSTOM, 1, 1, name};
    TIFFMergeFieldInfo(tif, &unknown, 1);
  }
  const TIFFField* const known = TIFFFieldWithTag(tif, tag.tag);
  if (known == nullptr || TIFFFieldDataType(known) != type) return;
  const std::size_t count = tag.bytes.size() / size_of(type);
  if (TIFFFieldPassCount(known) == 0)
    TIFFSetField(tif, tag.tag, tag.bytes.c_str());
  else if (TIFFFieldWriteCount(known) == TIFF_VARIABLE2)
    TIFFSetField(tif, tag.tag, static_cast<std::uint32_t>(count), tag.bytes.data());
  else
    TIFFSetField(tif, tag.tag, static_cast<int>(count), tag.bytes.data());
}

}  // namespace

void write_tags(TIFF* tif, const PageMetadata& about) {
  if (about.resolution) {
    using enum Resolution::Unit;
    const Resolution::Unit unit = about.resolution->unit;
    TIFFSetField(tif, TIFFTAG_XRESOLUTION, about.resolution->x);
    TIFFSetField(tif, TIFFTAG_YRESOLUTION, about.resolution->y);
    TIFFSetField(tif, TIFFTAG_RESOLUTIONUNIT,
                 unit == kNone ? RESUNIT_NONE : (unit == kCentimetre ? RESUNIT_CENTIMETER : RESUNIT_INCH));
  }
  if (about.orientation != 1) TIFFSetField(tif, TIFFTAG_ORIENTATION, about.orientation);
  if (!about.description.empty()) TIFFSetField(tif, TIFFTAG_IMAGEDESCRIPTION, about.description.c_str());
  if (!about.profile.empty())
    TIFFSetField(tif, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(about.profile.size()), about.profile.data());
  for (const TiffTag& tag : about.tiff_tags) write_tag(tif, tag);
}

}  // namespace pulson::images
