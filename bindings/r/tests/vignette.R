# The code of the vignette and of docs/r.md runs, with or without the packages that make a page of it.
source("helpers.R")

path <- file.path("..", "..", "pulson", "doc", "pulson.Rmd")
if (!file.exists(path)) path <- system.file("doc", "pulson.Rmd", package = "pulson")
if (!file.exists(path)) path <- Sys.getenv("PULSON_VIGNETTE")
if (!nzchar(path)) {
  cat("skipped: the vignette is not installed\n")
  quit(status = 0)
}
# The code of the blocks of a page that open so.
code_of <- function(path, opening) {
  lines <- readLines(path, encoding = "UTF-8")
  begins <- grep(opening, lines)
  ends <- vapply(begins, function(i) i + which(lines[-seq_len(i)] == "```")[1], 0)
  Map(function(i, j) lines[(i + 1):(j - 1)], begins, ends)
}

run <- function(code) {
  stopifnot(length(code) > 10)
  grDevices::pdf(tempfile(fileext = ".pdf"))
  on.exit(grDevices::dev.off())
  eval(parse(text = code), new.env())
}

invisible(run(unlist(code_of(path, "^```\\{r"))))

# The first block of the page of the documentation, which begins in the folder of the sources.
page <- Sys.getenv("PULSON_PAGE")
if (nzchar(page)) {
  code <- code_of(page, "^```r$")[[1]]
  setwd(dirname(dirname(page)))
  invisible(run(code))
}
