# cmake -DOUTPUT=... -DSTYLE=... -DHTML=... "-DSCRIPTS=a.js;b.js" -P embed_page.cmake
# Writes a C++ file with the page: the style and the scripts, in their order, within the HTML.
set(script "")
foreach(file IN LISTS SCRIPTS)
  file(READ ${file} part)
  string(APPEND script "${part}")
endforeach()
file(READ ${STYLE} style)
file(READ ${HTML} page)
string(REPLACE "{{style}}" "${style}" page "${page}")
string(REPLACE "{{script}}" "${script}" page "${page}")
string(HEX "${page}" digits)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${digits}")
# Lines of a bounded length.
string(REGEX REPLACE "((0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,)(0x..,))" "\\1\n" bytes
  "${bytes}")
file(WRITE ${OUTPUT} "#include <string_view>

namespace dynains::viewer {

constexpr unsigned char page_bytes[] = {\n${bytes}};

std::string_view page_template();
std::string_view page_template() {
  return {reinterpret_cast<const char*>(page_bytes), sizeof(page_bytes)};
}

}  // namespace dynains::viewer\n")
