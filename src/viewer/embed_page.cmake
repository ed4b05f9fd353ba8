# cmake -DOUTPUT=... -DSTYLE=... -DHTML=... "-DSCRIPTS=a.js;b.js" -P embed_page.cmake
# Writes a C++ file with the content of the files. Scripts are joined in their order.
function(embed name content)
  string(HEX "${content}" digits)
  string(REGEX REPLACE "(..)" "0x\\1," bytes "${digits}")
  # Lines of a bounded length.
  string(REGEX REPLACE "((0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,))" "\\1\n" bytes
    "${bytes}")
  set(text "${text}constexpr unsigned char ${name}_bytes[] = {\n${bytes}0};\n" PARENT_SCOPE)
endfunction()

set(script "")
foreach(file IN LISTS SCRIPTS)
  file(READ ${file} part)
  string(APPEND script "${part}")
endforeach()
file(READ ${HTML} html)
file(READ ${STYLE} style)

set(text "")
embed(html "${html}")
embed(style "${style}")
embed(script "${script}")
set(file "#include <cstddef>
#include <string_view>

namespace dynains::viewer {
namespace {

${text}
template <std::size_t kSize>
std::string_view text_of(const unsigned char (&bytes)[kSize]) {
  return {reinterpret_cast<const char*>(bytes), kSize - 1};
}

}  // namespace

std::string_view page_file(std::string_view name);
std::string_view page_file(std::string_view name) {
  if (name == \"html\") return text_of(html_bytes);
  return name == \"style\" ? text_of(style_bytes) : text_of(script_bytes);
}

}  // namespace dynains::viewer\n")
file(WRITE ${OUTPUT} "${file}")
