# The code of the vignette runs, with or without the packages that make a page of it.
source("helpers.R")

path <- file.path("..", "..", "pulson", "doc", "pulson.Rmd")
if (!file.exists(path)) path <- system.file("doc", "pulson.Rmd", package = "pulson")
if (!file.exists(path)) path <- Sys.getenv("PULSON_VIGNETTE")
if (!nzchar(path)) {
  cat("skipped: the vignette is not installed\n")
  quit(status = 0)
}
lines <- readLines(path, encoding = "UTF-8")
begins <- grep("^```\\{r", lines)
ends <- vapply(begins, function(i) i + which(lines[-seq_len(i)] == "```")[1], 0)
code <- unlist(Map(function(i, j) lines[(i + 1):(j - 1)], begins, ends))
stopifnot(length(code) > 10)
grDevices::pdf(tempfile(fileext = ".pdf"))
eval(parse(text = code), new.env())
invisible(grDevices::dev.off())
